# SPDX-License-Identifier: Apache-2.0
"""Without ROS: the closed loop in this process, and the same compiled for thousands of crossings.

The equations are those of `fivebar_control` and `fivebar_sim`, compiled as they stand (`compiling`); what is written
here is the integration of the compiled plant, the order of events in a sample, and what is kept of a run.
"""
