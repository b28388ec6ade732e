# SPDX-License-Identifier: Apache-2.0
"""The motor board of the MOTKIN bench on USB: its driver, its configuration, and the bridge `motkin_bridge`.

For whoever has that bench. It stands on `fivebar_control`, which never imports it, and shares the keys of a motor with
the emulated board by `fivebar_motkin_description`. `fivebar_vendor_drives` registers it as the interface `motkin`; the
executable `motkin_bridge` of the ROS package `fivebar_control` is its node.
"""
