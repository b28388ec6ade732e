# SPDX-License-Identifier: Apache-2.0
"""The processes of a launch file as those of a bench: `control.launch.py` without `ros2 launch`."""

from __future__ import annotations

import signal
from pathlib import Path

from forked_node import ForkedNode
from graph_probe import Bench

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.graph.node_spec import BRIDGES, EMULATED_ROBOT
from fivebar_bringup.runs.launched_graph import launched_processes
from fivebar_bringup.runs.launching import ControlRequest


class Launched:
    """The graph that a launch starts."""

    def __init__(self, bench: Bench, request: ControlRequest) -> None:
        self._processes = {}
        for one in launched_processes(request):
            file = Path(bench.folder, f"{one.name}.yaml")
            file.write_text(one.parameter_file, encoding="utf-8")
            words = ("--params-file", str(file))
            self._processes[one.name] = (
                bench.start_group(*one.arguments, "--ros-args", *words)
                if one.arguments
                else bench.start(one.executable, arguments=words)
            )

    def stop(self) -> None:
        """End all processes, the bridge before its drives, and the recorder last."""

        def rank(name: str) -> int:
            order = [*BRIDGES, "", EMULATED_ROBOT, RECORDER]
            return order.index(name if name in order else "")

        for name in sorted(self._processes, key=rank):
            process: ForkedNode = self._processes[name]
            process.send(signal.SIGINT)
            assert process.wait() == 0, process.stderr
