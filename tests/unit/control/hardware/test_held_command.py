# SPDX-License-Identifier: Apache-2.0
"""A torque that is held and not renewed is overdue, while the bridge drives the controller and until it is ended."""

from __future__ import annotations

from fivebar_control.hardware.held_command import HeldCommand


def test_only_a_torque_of_the_bridge_is_overdue() -> None:
    held = HeldCommand(0.03)
    held.take((1.0, 0.0), 0.0)
    # somebody else's
    assert held.overdue(1.0) is None
    held.take((0.0, 0.0), 1.0)
    held.follow(True)
    assert held.overdue(2.0) is None
    held.take((0.0, -1.0), 2.0)
    assert held.overdue(2.02) is None
    assert held.overdue(2.04) == 2.04 - 2.0
    # the bridge says that it has stopped, and the torque is still there
    held.follow(False)
    assert held.holds_torque
    held.take((0.0, 0.0), 2.05)
    assert not held.holds_torque
    held.take((1.0, 1.0), 2.1)
    assert held.overdue(9.0) is None
