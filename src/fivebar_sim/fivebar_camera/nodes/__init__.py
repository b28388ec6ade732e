# SPDX-License-Identifier: Apache-2.0
"""The node of the simulated camera."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
