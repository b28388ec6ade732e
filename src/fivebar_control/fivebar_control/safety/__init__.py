# SPDX-License-Identifier: Apache-2.0
"""Safety functions before the drives: staged limits, watchdog, and the guard that latches faults."""
