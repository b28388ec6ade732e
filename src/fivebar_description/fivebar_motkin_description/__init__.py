# SPDX-License-Identifier: Apache-2.0
"""The facts of the MOTKIN bench's motor board that its driver and its emulation share: the keys of a motor.

For `fivebar_motkin` and `fivebar_motkin_emulation`, which never import each other. It stands on `fivebar_description`,
which never imports it.
"""
