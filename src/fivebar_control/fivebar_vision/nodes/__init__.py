# SPDX-License-Identifier: Apache-2.0
"""The node that reads a camera's pictures."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
