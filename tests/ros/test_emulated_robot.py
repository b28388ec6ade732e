# SPDX-License-Identifier: Apache-2.0
"""The emulated robot beside a bridge: exact state and gyroscope for the samples that the bridge publishes."""

from __future__ import annotations

import os
import random
from pathlib import Path

import can
import yaml
from emulation_file import load_emulation
from graph_probe import RATE_HZ, Bench

from fivebar_description.files import share_file
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    MOTOR_STATES,
    RUN_STATUS,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state
from fivebar_sim.drives.emulation import SYNC_ID, open_bus


def test_a_bridge_that_begins_again_gets_readings_of_the_gyroscope_again(bench: Bench, tmp_path: Path) -> None:
    content = yaml.safe_load(share_file("fivebar_sim", "config", "drives", "dextar_emulated.yaml").read_text())
    content["bus"] |= {"channel": f"239.76.{os.getpid() % 256}.{random.randrange(1, 255)}"}
    path = tmp_path / "emulation.yaml"
    path.write_text(yaml.safe_dump(content))
    bench.start("emulated_robot", emulation=str(path))
    probe = bench.probe()
    probe.join("emulated_robot", [MOTOR_STATES, TORQUE_COMMAND, FAULTS], [GROUND_TRUTH, IMU_DATA, RUN_STATUS])
    q11, _, q21, _ = content["initial_joints"]
    with open_bus(load_emulation(str(path)).bus) as bus:
        bus.send(can.Message(arbitration_id=SYNC_ID, is_extended_id=False))
        for sample in (0, 1, 2, 0, 1):
            before = len(probe.got(IMU_DATA))
            states = joint_state(sample_stamp_ns(sample, RATE_HZ), ACTIVE_JOINTS, (q11, q21), effort=(0.0, 0.0))
            probe.ask([(MOTOR_STATES, states)], [GROUND_TRUTH], sample)
            probe.wait_for(lambda seen=before: len(probe.got(IMU_DATA)) > seen, f"the reading of sample {sample}")
    assert probe.samples(IMU_DATA) == [0, 1, 2, 0, 1]
