# SPDX-License-Identifier: Apache-2.0
"""The node that serves the live page."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
