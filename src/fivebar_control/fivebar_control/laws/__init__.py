# SPDX-License-Identifier: Apache-2.0
"""The control laws as pure functions of state, reference and parameters; torques in Nm, NaN where undefined."""
