# SPDX-License-Identifier: Apache-2.0
"""Faults in plain words: what happened, and how the robot can move again.

`python -m fivebar_bringup.reference.faults` prints all of them, and the documentation site has them. Faults of drives
stand beside their drivers.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from fivebar_description.drive_kinds import drive_kind, interfaces
from fivebar_description.modules import load_part


class Advice(NamedTuple):
    """The meaning of a fault, and its recovery."""

    meaning: str
    recovery: str


_RESET = "Reset it once the cause is gone."
_AT_REST = "Wait until the robot is at rest, then reset it."
_MOVE_BACK = "Move the platform back by hand, then reset it."
_NEW_RUN = "Start a new run."
_HOME = "Home the robot, then start a new run."

ADVICE = {
    "torque_undefined": Advice("A controller could not compute a torque for this posture.", _RESET),
    "torque_excessive": Advice(
        "A controller asks for more than request_ratio times the torque limit, for request_samples.", _RESET
    ),
    "candidate_missing": Advice(
        "A controller or the supervisor did not answer in time.", "Reset once it answers again."
    ),
    "state_stale": Advice(
        "No new joint states came for stop_time_ms, 20 ms where the motion bears it.", "Reset once they arrive again."
    ),
    "over_speed": Advice("A motor turned faster than joint_speed_limit.", _AT_REST),
    "forbidden_posture": Advice("The robot is about to enter a posture that its file forbids.", _MOVE_BACK),
    "out_of_workspace": Advice("The platform left its workspace, or the joint states contradict it.", _MOVE_BACK),
    "near_type_1": Advice("A leg is almost stretched or folded, or in the other working mode.", _MOVE_BACK),
    "tracking_lost": Advice("The platform is further than tracking_error_limit from its reference.", _RESET),
    "emergency_stop": Advice("Someone pressed emergency stop.", _RESET),
    "second_publisher": Advice(
        "Another program publishes a topic of the control chain, or two different messages of one sample have come.",
        "End the other program, then reset it, and plant or bridge where they have latched it too.",
    ),
    "encoder_frozen": Advice("The reading of a motor that moves does not change.", "Check the encoder. " + _NEW_RUN),
    "estimate_ambiguous": Advice("The crossing was so slow that the encoders fit the other assembly mode too.", _HOME),
    "estimate_inconsistent": Advice(
        "Readings differ from the predictions by more than what is declared explains; the fault names the causes, the"
        " likeliest first.",
        "`fivebar identify --resonance` tells of elasticity and play, `fivebar calibrate` of lengths and zeros. "
        + _NEW_RUN,
    ),
    "gyroscope_missing": Advice(
        "No reading of the gyroscope has come for ekf.gyro_timeout.", "Check power, cable and driver. " + _NEW_RUN
    ),
    "gyroscope_late": Advice(
        "The gyroscope's stamps are more than 20 ms behind the motors'.", "Check its clock and latency. " + _NEW_RUN
    ),
    "gyroscope_early": Advice(
        "The gyroscope's stamps are more than 20 ms ahead of the motors'.", "Check its clock. " + _NEW_RUN
    ),
    "gyroscope_saturated": Advice(
        "The gyroscope is at the end of its range.", "Choose a larger range, or move slower. " + _NEW_RUN
    ),
    "gyroscope_frozen": Advice(
        "The gyroscope repeats its reading while the link's rate changes, or has a smaller range than declared.",
        "Check the gyroscope. " + _NEW_RUN,
    ),
    "estimate_lost": Advice(
        "The estimated platform is out of reach, or motor readings are missing for more than 20 ms.", _HOME
    ),
    "homing_contradicted": Advice(
        "The encoders contradict the declared start posture.", "Put the robot there, then start a new run."
    ),
    "command_timeout": Advice("The controllers did not answer within 5 s.", _NEW_RUN),
    "command_stale": Advice("The newest torque is too old.", _RESET),
    "feedback_invalid": Advice("A drive reads no finite number.", "Check its driver, then reset."),
    "plant_diverged": Advice("The simulation became inaccurate: the motion is too fast for it.", _NEW_RUN),
    "nodes_missing": Advice(
        "A node did not start, lacks an input or cannot be heard.", "Look into its log, then start a new run."
    ),
    "node_died": Advice("A node has ended.", "Look into its log, then start a new run."),
    "recording_failed": Advice(
        "The bag cannot be written; it keeps its last checkpoint.", "Make room on the disk, then start a new run."
    ),
    "interrupted": Advice("The run was interrupted.", _NEW_RUN),
}
"""Faults of the graph."""

NO_ADVICE: Mapping[str, tuple[str, str]] = {}

UNKNOWN = Advice("The robot has stopped.", "docs/reference/faults.md has the faults of all drives.")


def advice(fault: str, of_drives: Mapping[str, tuple[str, str]] = NO_ADVICE) -> Advice:
    """Return what the text of a fault, which begins with its name, means.

    Args:
        fault: the text.
        of_drives: meaning and recovery of the faults of the robot's drives.
    """
    name = fault.partition(":")[0].strip()
    return Advice(*of_drives[name]) if name in of_drives else ADVICE.get(name, UNKNOWN)


def advice_of_drives(interface: str) -> Mapping[str, tuple[str, str]]:
    """Return meaning and recovery of the faults of drives, by name; of no drives where the interface is empty.

    Raises:
        InputError: there is no such interface, or it cannot be loaded.
    """
    faults = drive_kind(interface).faults if interface else ""
    return load_part(faults) if faults else NO_ADVICE


HEAD = """\
# Faults

Every fault has a name and the same end: the torque is zero and stays there until the fault is reset.

"""


def faults_page() -> str:
    """Return the page as Markdown: faults of the graph, then those of each interface of drives."""
    drives = {interface: advice_of_drives(interface) for interface in interfaces()}
    parts = {"The graph": ADVICE, **{f"Drives: {name}": faults for name, faults in drives.items() if faults}}
    return HEAD + "\n".join(f"## {title}\n\n{_table(faults)}" for title, faults in parts.items())


def _table(faults: Mapping[str, tuple[str, str]]) -> str:
    rows = [f"| `{name}` | {meaning} | {recovery} |" for name, (meaning, recovery) in faults.items()]
    return "\n".join(["| fault | meaning | recovery |", "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    print(faults_page(), end="")
