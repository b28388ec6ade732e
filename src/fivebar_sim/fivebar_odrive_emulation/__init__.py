# SPDX-License-Identifier: Apache-2.0
"""Two emulated ODrives on a CAN bus, which move the simulated robot.

For rehearsals without the drives. It stands on the emulated motors of `fivebar_sim.motors`, which never import it, and
takes nothing from the driver `fivebar_odrive`, so that each checks the other. The interface `odrive` of
`fivebar_vendor_drives` names it, and `fivebar commission --practice` has its robot on such drives.
"""
