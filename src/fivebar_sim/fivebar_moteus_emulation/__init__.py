# SPDX-License-Identifier: Apache-2.0
"""Two emulated moteus drives on a CAN FD bus, which move the simulated robot.

For rehearsals without the drives. It stands on the emulated motors of `fivebar_sim.motors`, which never import it, and
takes nothing from the driver `fivebar_moteus` or the vendor's library, so that each checks the other. The interface
`moteus` of `fivebar_vendor_drives` names it.
"""
