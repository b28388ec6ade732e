# SPDX-License-Identifier: Apache-2.0
"""The simulated camera: pictures of the robot, rendered on the processor, and when they are exposed and arrive.

For whoever runs a simulated robot under a camera, with pictures or with simulated positions in their place.
It stands on the settings of `fivebar_description`, on the camera model of `fivebar_optics` and on the plant of
`fivebar_sim`, which never imports it.
The node `camera` is an executable; engine and plant find the schedule of the pictures by entry points of the group
`fivebar.sensors`.
"""
