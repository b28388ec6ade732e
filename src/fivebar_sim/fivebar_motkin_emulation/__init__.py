# SPDX-License-Identifier: Apache-2.0
"""An emulated motor board with the USB protocol of the MOTKIN bench, which moves the simulated robot. No ROS in here.

For rehearsals without the bench. It stands on the robot of `fivebar_sim`, which never imports it, and takes nothing
from the driver `fivebar_motkin`, so that each checks the other. The interface `motkin` of `fivebar_vendor_drives`
names it; the executable `emulated_board` is the board alone.
"""
