# SPDX-License-Identifier: Apache-2.0
"""Two moteus drives on a CAN FD bus: their driver, and the vendor's adapters on a serial port.

For whoever has such drives. It stands on two motors of any interface, and on the CAN bus, of
`fivebar_control.hardware`, which never imports it, and on the vendor's library (`pip install 'fivebar[moteus]'`).
`fivebar_vendor_drives` registers it as the interface `moteus`.
"""
