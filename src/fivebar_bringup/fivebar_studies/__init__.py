# SPDX-License-Identifier: Apache-2.0
"""Studies: thousands of runs of many robots, as tables and pages.

For whoever judges robots, laws and claims: sweep, compare, robustness, benchmark, assess, estimate and reproduce.
It stands on the compiled engine, the planner and the odds of `fivebar_bringup`, which never import it.
The command `fivebar` finds its subcommands by entry points of the group `fivebar.commands`, and the Python interface
finds `fivebar.sweep` by one of `fivebar.python`.
"""
