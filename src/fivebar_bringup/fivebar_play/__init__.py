# SPDX-License-Identifier: Apache-2.0
"""The page that explains by play: the project's own model and laws in a browser, translated into JavaScript.

For whoever wants to understand a singularity by dragging the robot onto it; the page needs neither server nor network.
It stands on model and laws of `fivebar_control`, whose functions it translates, and on the offline runner.
The command `fivebar` finds `play` by an entry point of the group `fivebar.commands`; nothing else imports it.
"""
