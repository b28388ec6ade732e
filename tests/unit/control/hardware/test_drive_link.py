# SPDX-License-Identifier: Apache-2.0
"""One drive's frames turned into readings and faults, with a clock that the test turns."""

from __future__ import annotations

import math

import pytest

from fivebar_control.hardware.configuration import Drive, load_drives
from fivebar_control.hardware.drive_link import DriveLink
from fivebar_control.hardware.frames import Effort, Emergency, Heartbeat, Status

PERIOD_US = 2000
LIMIT = 3
ENABLED, FAULT = 0x0237, 0x0218


@pytest.fixture
def drive() -> Drive:
    return load_drives("dextar_emulated").pair[0].model_copy(update={"velocity_units_per_rev_s": 60.0})


@pytest.fixture
def link(drive: Drive) -> DriveLink:
    link = DriveLink("q11", drive, PERIOD_US, LIMIT)
    link.take(Heartbeat(0, 5), 10.0)
    return link


def cycle(link: DriveLink, counts: int = 0, torque: int = 0, velocity: int | None = 0, word: int = ENABLED) -> object:
    link.expect()
    link.take(Status(0, word, counts), 10.0)
    link.take(Effort(0, torque, velocity), 10.0)
    return link.close_cycle()


def test_a_reading(link: DriveLink) -> None:
    quarter = link.drive.counts_per_revolution // 4
    # 30 rpm are pi rad/s; 500 per mille of 2 Nm
    assert cycle(link, quarter, 500, 30) == pytest.approx((math.pi / 2, math.pi, 1.0), abs=1e-12)
    assert link.fault(10.05) is None


def test_half_an_answer_is_none(link: DriveLink) -> None:
    link.expect()
    link.take(Status(0, ENABLED, 0), 10.0)
    assert not link.complete
    assert link.close_cycle() is None
    link.expect()
    link.take(Effort(0, 0, 0), 10.0)
    assert link.close_cycle() is None
    assert link.missed == 2


@pytest.mark.parametrize("answer", [Status(0, ENABLED, 9), Effort(0, 0, 0)])
def test_what_answered_the_sync_before_is_no_half_of_an_answer(link: DriveLink, answer: Status | Effort) -> None:
    assert cycle(link) is not None
    link.expect()
    link.take(answer, 10.0)
    assert not link.complete
    assert link.close_cycle() is None


def test_velocity_from_positions_counts_missed_cycles(drive: Drive) -> None:
    link = DriveLink("q11", drive.model_copy(update={"velocity_in_pdo": False}), PERIOD_US, LIMIT)
    step = 2.0 * math.pi / drive.counts_per_revolution
    first = cycle(link, 100, 0, None)
    assert first == pytest.approx((100 * step, 0.0, 0.0))
    assert cycle(link, 110, 0, None) == pytest.approx((110 * step, 10 * step / 0.002, 0.0))
    link.expect()
    assert link.close_cycle() is None
    assert cycle(link, 130, 0, None) == pytest.approx((130 * step, 20 * step / 0.004, 0.0))


@pytest.mark.parametrize(("before", "after", "moved"), [(2**31 - 3, -(2**31) + 4, 7), (-(2**31) + 1, 2**31 - 2, -3)])
def test_a_position_counter_that_wraps_goes_on(drive: Drive, before: int, after: int, moved: int) -> None:
    link = DriveLink("q11", drive.model_copy(update={"velocity_in_pdo": False}), PERIOD_US, LIMIT)
    step = 2.0 * math.pi / drive.counts_per_revolution
    cycle(link, before, 0, None)
    assert cycle(link, after, 0, None) == pytest.approx(((before + moved) * step, moved * step / 0.002, 0.0))
    assert cycle(link, after, 0, None) == pytest.approx(((before + moved) * step, 0.0, 0.0))
    assert cycle(link, before, 0, None) == pytest.approx((before * step, -moved * step / 0.002, 0.0))


@pytest.mark.parametrize("way", [1, -1])
def test_an_encoder_that_counts_no_turns_goes_on(drive: Drive, way: int) -> None:
    """Its counts begin again with every revolution of the motor, whether a cycle is missed or not."""
    link = DriveLink("q11", drive.model_copy(update={"velocity_in_pdo": False}), PERIOD_US, LIMIT)
    turn = drive.counts_per_revolution
    step, moved = 2.0 * math.pi / turn, way * turn // 12
    assert cycle(link, 0, 0, None) == pytest.approx((0.0, 0.0, 0.0))
    for number in range(1, 30):
        reading = cycle(link, number * moved % turn, 0, None)
        assert reading == pytest.approx((number * moved * step, moved * step / 0.002, 0.0))
    link.expect()
    assert link.close_cycle() is None
    assert cycle(link, 31 * moved % turn, 0, None) == pytest.approx((31 * moved * step, moved * step / 0.002, 0.0))


def test_the_age_of_the_heartbeat_counts_and_not_the_last_state(link: DriveLink) -> None:
    cycle(link)
    assert link.fault(10.5) is None
    fault = link.fault(10.501)
    assert fault is not None
    assert str(fault) == "drive_lost: q11 (node 1): last heartbeat 501 ms ago, limit 500 ms"
    link.take(Heartbeat(0, 5), 10.6)
    assert link.fault(10.7) is None


def test_a_drive_that_was_never_heard_is_lost(drive: Drive) -> None:
    fault = DriveLink("q11", drive, PERIOD_US, LIMIT).fault(0.0)
    assert fault is not None
    assert (fault.name, "no heartbeat yet" in fault.detail) == ("drive_lost", True)


@pytest.mark.parametrize(("state", "words"), [(0, "boot-up"), (127, "pre-operational"), (4, "stopped")])
def test_a_drive_that_left_operational_has_restarted(link: DriveLink, state: int, words: str) -> None:
    cycle(link)
    link.take(Heartbeat(0, state), 10.0)
    fault = link.fault(10.0)
    assert fault is not None
    assert fault == ("drive_restarted", f"q11 (node 1): NMT state {words}, expected operational")


def test_missing_answers_are_a_fault_beyond_the_limit(link: DriveLink) -> None:
    cycle(link)
    for _ in range(LIMIT):
        link.expect()
        link.close_cycle()
        assert link.fault(10.0) is None
    link.expect()
    link.close_cycle()
    fault = link.fault(10.0)
    assert fault is not None
    assert fault.name == "feedback_missing"
    cycle(link)
    assert link.fault(10.0) is None


def test_a_fault_is_told_with_its_cause(link: DriveLink) -> None:
    cycle(link, word=FAULT)
    fault = link.fault(10.0)
    assert fault == ("drive_fault", "q11 (node 1): statusword 0x0218, no emergency message")
    link.take(Emergency(0, 0x7305, 0x01, bytes(5)), 10.0)
    fault = link.fault(10.0)
    assert fault == (
        "drive_fault",
        "q11 (node 1): statusword 0x0218, incremental encoder 1 (0x7305), error register 0x01",
    )


def test_an_emergency_alone_is_a_fault_until_forgotten(link: DriveLink) -> None:
    cycle(link)
    link.take(Emergency(0, 0x4310, 0x09, bytes(5)), 10.0)
    link.take(Emergency(0, 0x0000, 0x00, bytes(5)), 10.0)
    # the statusword of a fault would come with the next answer
    cycle(link)
    assert link.fault(10.0) is None
    cycle(link)
    fault = link.fault(10.0)
    assert fault is not None
    assert (fault.name, "over-temperature of the drive" in fault.detail) == ("drive_emergency", True)
    link.forget()
    assert link.fault(10.0) is None


def test_an_error_reset_is_no_fault(link: DriveLink) -> None:
    cycle(link)
    link.take(Emergency(0, 0x0000, 0x00, bytes(5)), 10.0)
    assert link.fault(10.0) is None


@pytest.mark.parametrize("torque", [500, -500])
def test_a_frozen_encoder_under_torque(link: DriveLink, torque: int) -> None:
    """1 Nm to either side for more than 200 ms, which are 100 periods of 2 ms; 1 Nm is 500 per mille."""
    cycle(link, 7, torque)
    for _ in range(99):
        cycle(link, 7, torque)
    assert link.fault(10.0) is None
    for _ in range(2):
        cycle(link, 7, torque)
    fault = link.fault(10.0)
    assert fault is not None
    assert fault.name == "encoder_frozen"
    cycle(link, 8, torque)
    assert link.fault(10.0) is None


@pytest.mark.parametrize(("torque", "step"), [(499, 0), (500, 1), (-500, 1)])
def test_an_encoder_that_rests_or_moves_is_not_frozen(link: DriveLink, torque: int, step: int) -> None:
    for k in range(300):
        cycle(link, k * step, torque)
    assert link.fault(10.0) is None
