"""What the nodes of one run must share: each compares its own parameters with the plan that the run has published."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from std_msgs.msg import String

from fivebar_description.interface import RUN_PLAN
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.qos import qos_profile
from fivebar_description.run_plan import RunPlan, difference, read_plan


class RunAgreement:
    """The part of a node in its run; a node makes one after its parameters are declared.

    The trajectory generator publishes the plan once, latched. The node waits for it, and while a value differs it
    refuses to answer: parameters given to one node only would otherwise go unnoticed. A new plan, of a trajectory
    generator that was started again, is compared anew. Requested motions do not change the plan: it is what the nodes
    were started with. Where nobody publishes a plan, with a node that is tried by itself, there is nothing to compare.
    """

    def __init__(self, node: GraphNode, rate_hz: int, values: Mapping[str, Any]) -> None:
        """Subscribe to the plan on behalf of a node.

        Args:
            node: the node.
            rate_hz: its sampling rate.
            values: its other values that the plan may hold, by their names in the plan.
        """
        self._node = node
        self._own = {"rate_hz": rate_hz, **values}
        self._plan: RunPlan | None = None
        self.problem = ""
        """The difference from the plan, for people; empty without one."""
        node.agreement = self
        # made before the inputs, so that a plan that was published first is also known first
        node.create_subscription(String, RUN_PLAN.name, self._on_plan, qos_profile(RUN_PLAN.qos))

    @property
    def holds(self) -> bool:
        """Whether the node may answer: the plan has come, where there is one, and agrees."""
        return not self.problem and (self._plan is not None or not self._node.count_publishers(RUN_PLAN.name))

    @property
    def digest(self) -> str:
        """The digest of the plan, empty before it has come."""
        return self._plan.digest if self._plan is not None else ""

    def _on_plan(self, message: String) -> None:
        try:
            plan = read_plan(message.data)
        except ValueError as error:
            self._node.drop(RUN_PLAN, str(error))
            return
        self._plan = plan
        found = difference(self._own, plan)
        self.problem = "" if found is None else f"plan_differs: {found}"
        if found is not None:
            self._node.get_logger().error(f"refuses to answer: {found}")
