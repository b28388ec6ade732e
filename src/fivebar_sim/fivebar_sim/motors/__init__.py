# SPDX-License-Identifier: Apache-2.0
"""Two emulated motors of any interface: the robot that they move, their encoders, faults and watchdog."""
