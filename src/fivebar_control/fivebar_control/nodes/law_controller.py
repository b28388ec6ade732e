"""Publishes the candidate torque of any control law, which the parameter `law` names."""

from __future__ import annotations

from fivebar_control.ros.controller_node import ControllerNode
from fivebar_description.ros.run import run_node


class LawController(ControllerNode):
    """Any law of the registry, or one from another package as MODULE:NAME."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("law_controller", "unified", ("",))


def main() -> None:
    """Run the node."""
    run_node(LawController)


if __name__ == "__main__":
    main()
