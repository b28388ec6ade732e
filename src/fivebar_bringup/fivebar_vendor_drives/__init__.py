# SPDX-License-Identifier: Apache-2.0
"""The interfaces `motkin`, `odrive` and `moteus`: where their parts are, and the files of a run on such drives.

For whoever has such drives; without it a robot crosses on CANopen drives, under ros2_control, or on drives of one's
own. It stands on `fivebar_bringup.drives`, which never imports it and finds it by entry points of the group
`fivebar.drives`. Drivers are in `fivebar_motkin`, `fivebar_odrive` and `fivebar_moteus`, emulations in the packages of
these names with `_emulation`.
"""
