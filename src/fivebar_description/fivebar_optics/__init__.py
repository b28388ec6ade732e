# SPDX-License-Identifier: Apache-2.0
"""The model of a camera: its lens and where it looks, from points of the world to pixels and back.

For the packages that render pictures and that read them, which share nothing else, so that each checks the other.
It stands on the settings of a camera in `fivebar_description`.
`fivebar_camera`, `fivebar_vision` and `fivebar_camera_runs` import it, nothing of the core does.
"""
