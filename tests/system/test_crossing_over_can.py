"""The whole graph over the emulated bus: estimator, controllers, bridge and drives cross the singularity twice."""

from __future__ import annotations

import math
import os
import random
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml
from graph_probe import Bench
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.interface import FAULTS, JOINT_STATES, REFERENCE, RUN_READY
from fivebar_description.parameters import load_robot
from fivebar_description.ros.messages import stamp_of
from fivebar_description.share import share_file

RATE_HZ = 100
"""Slow enough for a machine that has other work to do."""

LAST = 2 * RATE_HZ
COUNTS, DELAY, LIMIT = 262144, 1, 5.0


def drive_files(folder: Path) -> tuple[Path, Path]:
    """The shipped files of the drives and of the bridge, at this rate and on a bus of this test's own."""
    rng = random.Random(os.getpid() ^ time.monotonic_ns())
    channel = f"239.76.{rng.randrange(256)}.{rng.randrange(1, 255)}"
    bus = {"interface": "udp_multicast", "channel": channel, "port": rng.randrange(20000, 60000)}
    paths = []
    for package, more in (("fivebar_sim", {}), ("fivebar_control", {"gather_deadline_us": 9000})):
        content = yaml.safe_load(share_file(package, "config", "drives", "dextar_emulated.yaml").read_text())
        paths.append(folder / f"{package}.yaml")
        changes: dict[str, Any] = {"bus": bus, "sync_period_us": 1_000_000 // RATE_HZ, **more}
        paths[-1].write_text(yaml.safe_dump({**content, **changes}))
    return paths[0], paths[1]


def test_the_middle_crossing(tmp_path: Path) -> None:
    emulation, drives = drive_files(tmp_path)
    plan = {"rate_hz": RATE_HZ, "lead_samples": DELAY}
    nodes: dict[str, dict[str, Any]] = {
        "trajectory_generator": plan,
        "supervisor": plan,
        "ctc_controller": plan,
        "vhc_controller": plan,
        "blender": {"rate_hz": RATE_HZ},
        "state_estimator": {
            "rate_hz": RATE_HZ, "encoder_counts": COUNTS, "delay_samples": DELAY, "torque_limit": LIMIT,
        },
        "dextar_bridge": {"rate_hz": RATE_HZ, "drives": str(drives), "command_timeout_ms": 500.0},
    }  # fmt: skip
    with Bench(tmp_path) as bench:
        emulated = bench.run([str(Path(sys.executable).parent / "emulated_drives"), str(emulation)])
        for node, parameters in nodes.items():
            bench.start(node, **parameters)
        probe = bench.probe()
        probe.listen(FAULTS, JOINT_STATES, REFERENCE)
        probe.wait_for(lambda: set(nodes) <= {message.data for message in probe.got(RUN_READY)}, "all nodes", 60.0)
        probe.wait_for(lambda: "ready" in emulated.stdout, "the drives")
        for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            request = ChangeState.Request(transition=Transition(id=transition))
            assert probe.call(ChangeState, "/dextar_bridge/change_state", request).success

        def ended() -> bool:
            return bool(probe.got(FAULTS)) or (probe.samples(JOINT_STATES, RATE_HZ) or [0])[-1] == LAST

        probe.wait_for(ended, f"sample {LAST}", 60.0)
        assert [message.data for message in probe.got(FAULTS)] == []
        robot = load_robot()
        references = {stamp_of(message): message.position for message in probe.got(REFERENCE)}
        states = [state_from_joints(robot, *one.position, *one.velocity) for one in probe.got(JOINT_STATES)]
        folds = [math.sin(q21 + q22 - q11 - q12) for q11, q12, q21, q22 in
                 (one.position for one in probe.got(JOINT_STATES))]  # fmt: skip
        # the last messages of one topic may come before those of another
        errors = [
            math.dist((state.x, state.y), references[stamp_of(message)][:2])
            for state, message in zip(states, probe.got(JOINT_STATES), strict=True)
            if stamp_of(message) in references
        ]
        assert len(errors) > 0.9 * len(states)
        print(f"largest distance from the reference {max(errors) * 1e3:.2f} mm")
        assert sum(before * after < 0.0 for before, after in pairwise(folds)) == 2
        assert min(state.y for state in states) < 0.022
        assert max(errors) < 0.01
