# SPDX-License-Identifier: Apache-2.0
"""The guard's part of the control cycle, in the interpreter."""

from __future__ import annotations

from fivebar_control.laws.torque import Torque
from fivebar_control.loop.node_parts import JointValues, Pair
from fivebar_control.loop.shared_results import shared_state
from fivebar_control.safety.guard import Decision, Guard


class GuardPart(Guard):
    """The guard of a robot."""

    def answer(
        self,
        sample: int,
        joints: JointValues,
        desired: Pair,
        sigma: float,
        nominal: Torque,
        constraint: Torque,
    ) -> Decision:
        """Return `command` for the joints of a sample."""
        state = shared_state(sample, self._robot, *joints)
        return self.command(sample, state, desired, sigma, nominal, constraint)

    def stop_at(self, sample: int, joints: JointValues) -> Torque:
        """Return `stop` for the joints of a sample."""
        return self.stop(shared_state(sample, self._robot, *joints))
