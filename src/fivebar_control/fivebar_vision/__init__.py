# SPDX-License-Identifier: Apache-2.0
"""Pictures become positions: tags in a camera's pictures, the platform's place by them, and the lens from a board.

For whoever lets a camera look down on a robot, to validate a run or to help its estimator.
It stands on the topics and settings of `fivebar_description`, on the reading that the estimator of `fivebar_control`
takes, and on the camera model of `fivebar_optics`; nothing of the core imports it.
The node `vision_listener` is an executable; a calibration is found by an entry point of the group `fivebar.sensors`.
"""
