# SPDX-License-Identifier: Apache-2.0
"""Leads from a box of parts to the first crossing: steps with a gate each, on real drives or on a simulated robot.

For whoever sets a robot up; each step writes what it has found into the files of robot and drives.
It stands on runs, calibration and identification of `fivebar_bringup`, and for its assessment on `fivebar_studies`.
The command `fivebar` finds `commission` by an entry point of the group `fivebar.commands`; nothing else imports it.
"""
