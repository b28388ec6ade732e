# SPDX-License-Identifier: Apache-2.0
"""A member of a domain that is interrupted while it takes a message."""

from __future__ import annotations

import signal

import pytest
from graph_probe import Bench
from std_msgs.msg import String

from fivebar_description.errors import InputError
from fivebar_description.interface import GOAL_STATUS
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.ros.domain_member import DomainMember

DEADLINE = 30.0


def test_a_signal_while_a_message_is_converted_is_an_interrupt(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """rclpy makes a message in C++ by calling its class, where an exception of a signal's handler would be lost."""
    make = String.__init__
    made = []

    def interrupted(self: String, **fields: object) -> None:
        make(self, **fields)
        made.append(self)
        signal.raise_signal(signal.SIGTERM)

    with DomainMember("sender", bench.domain) as sender, DomainMember("receiver", bench.domain) as receiver:
        taken: list[String] = []
        receiver.listen(GOAL_STATUS, taken.append)
        publisher = sender.advertise(GOAL_STATUS)
        assert receiver.wait_for(publisher.get_subscription_count, DEADLINE)
        publisher.publish(String(data="any"))
        monkeypatch.setattr(String, "__init__", interrupted)
        with pytest.raises(KeyboardInterrupt), keyboard_interrupts():
            receiver.wait_for(lambda: taken, DEADLINE)
    assert len(made) == 1
    assert [message.data for message in taken] == ["any"]


def test_ros_that_does_not_start_is_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    with pytest.raises(InputError, match=r"^ROS does not start in domain 7: .*: look at ROS_SECURITY_ENABLE$"):
        DomainMember("probe", 7)
