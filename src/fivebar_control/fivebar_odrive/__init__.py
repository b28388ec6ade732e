# SPDX-License-Identifier: Apache-2.0
"""Two ODrives on a CAN bus, by the protocol CAN Simple: their driver.

For whoever has such drives. It stands on two motors of any interface, and on the CAN bus, of
`fivebar_control.hardware`, which never imports it. `fivebar_vendor_drives` registers it as the interface `odrive`.
"""
