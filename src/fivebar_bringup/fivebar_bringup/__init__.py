# SPDX-License-Identifier: Apache-2.0
"""Launch files, scenarios, the fivebar command, the bag recorder and the reports of the five-bar robot."""
