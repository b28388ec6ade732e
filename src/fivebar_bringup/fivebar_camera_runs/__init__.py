# SPDX-License-Identifier: Apache-2.0
"""Runs with a camera: simulated without ROS, as nodes of the graph, in series and figures, and its calibration.

For whoever runs a robot under a camera.
It stands on `fivebar_camera`, which renders pictures, on `fivebar_vision`, which reads them, and on runs and reports of
`fivebar_bringup`.
The command `fivebar` finds `camera-calibrate` by an entry point of the group `fivebar.commands`; runs and reports find
the rest by entry points of the group `fivebar.sensors`, where a scenario has a camera.
"""
