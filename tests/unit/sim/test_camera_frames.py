# SPDX-License-Identifier: Apache-2.0
"""When pictures are exposed and arrive, and what lockstep waits for."""

from __future__ import annotations

import pytest

from fivebar_camera.camera import Camera
from fivebar_camera.frames import FrameSchedule
from fivebar_camera.sights import Sights
from fivebar_description.camera import CameraSettings
from fivebar_description.robot_file import load_robot

RATE_HZ = 500
LATE = CameraSettings(on=True, latency=0.03, jitter=0.02, dropped=0.2)


def test_pictures_are_late_by_latency_and_jitter_and_some_are_lost() -> None:
    schedule, arrived, exposed = FrameSchedule(LATE, RATE_HZ, seed=3), [], 0
    for sample in range(4000):
        exposed += schedule.exposed(sample) is not None
        arrived += [(sample - frame.sample, frame.sample) for frame in schedule.arrived(sample)]
    delays = [delay for delay, made in arrived if made > 0]
    assert {made % LATE.every(RATE_HZ) for _, made in arrived} == {0}
    assert min(delays) >= 15
    assert max(delays) <= 25
    assert len(set(delays)) > 5
    assert 0.7 < exposed / (4000 / 8) < 0.9
    # the robot has been seen when the run begins
    assert arrived[0] == (0, 0)


def test_the_same_seed_gives_the_same_pictures() -> None:
    one, two, other = (FrameSchedule(LATE, RATE_HZ, seed) for seed in (1, 1, 2))
    frames = [[schedule.exposed(sample) for sample in range(0, 400, 8)] for schedule in (one, two, other)]
    assert frames[0] == frames[1] != frames[2]


def test_exposures_that_are_skipped_leave_the_others_as_they_are() -> None:
    robot, settings = load_robot("dextar"), LATE._replace(pictures=False, dropped=0.0)
    joints, rest = (1.66, -0.92, 1.48, 0.92), (0.0,) * 4
    whole, partly = (Camera(robot, settings, RATE_HZ, seed=3) for _ in range(2))
    arrived = [one for sample in range(200) for one in whole.take(sample, joints, rest)]
    rare = [one for sample in range(200) for one in partly.take(sample, joints, rest, skips=sample % 16 == 8)]
    assert rare == [one for one in arrived if one.sample % 16 != 8]
    assert 0 < len(rare) < len(arrived)


@pytest.mark.parametrize("repeats", [1, 3])
def test_a_sample_waits_for_the_positions_that_come_with_it(repeats: int) -> None:
    """Repeated samples and repeated answers change nothing."""
    sights, schedule = Sights(LATE, RATE_HZ, seed=3), FrameSchedule(LATE, RATE_HZ, seed=3)
    for sample in range(200):
        schedule.exposed(sample)
        expected = [1000 + frame.sample for frame in schedule.arrived(sample)]
        for _ in range(repeats):
            sights.expect(sample)
        assert sights.complete is not bool(expected)
        for stamp in expected:
            for _ in range(repeats):
                sights.note(stamp)
        assert sights.complete
        assert [sights.taken(sample) for _ in range(repeats)] == [expected] * repeats
