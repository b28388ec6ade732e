# SPDX-License-Identifier: Apache-2.0
"""Bags: what goes in comes out, for every reader; and neither a kill nor a full disk makes a bag unreadable."""

from __future__ import annotations

import errno
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from full_disk import full_at
from mcap.reader import NonSeekingReader, make_reader
from rosbags.rosbag2 import Reader

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.definitions import TYPESTORE, absolute_name, type_hash
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.bag.tail import PAGE
from fivebar_bringup.bag.writer import RECORDING_RECORD, BagWriter
from fivebar_bringup.errors import BagError
from fivebar_bringup.identify.reading import joint_columns
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    NANOSECONDS,
    PASSIVE_STATES,
    RUN_EPOCH,
    RUN_STATUS,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TOPICS,
    TORQUE_COMMAND,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.run_plan import epoch_text

RATE_HZ = 500
AWKWARD = (0.1, -0.0, float("nan"), float("inf"), 5e-324, -1.7976931348623157e308, 1 / 3)
"""Floats that do not survive a detour through text, float32 or arithmetic."""

Messages = dict[str, list[tuple[int, int, bytes]]]
"""Per absolute topic name the messages: log time, publish time, data."""


def awkward(sample: int, count: int) -> list[float]:
    return [AWKWARD[(sample + index) % len(AWKWARD)] for index in range(count)]


def sample_messages(sample: int) -> Iterator[tuple[Topic, bytes]]:
    """All messages of one control cycle, as a run has them."""
    stamp = sample_stamp_ns(sample, RATE_HZ)
    for topic in TOPICS:
        if topic.type == "sensor_msgs/msg/JointState":
            yield topic, serialize.joint_state(stamp, JOINTS, awkward(sample, 4), effort=awkward(sample + 1, 4))
        elif topic.type == "sensor_msgs/msg/Imu":
            yield topic, serialize.imu(stamp, "end_effector", awkward(sample, 3), awkward(sample + 2, 3))
        elif topic.type == "std_msgs/msg/Float64":
            yield topic, serialize.float64(awkward(sample, 1)[0])
    if sample % 100 == 0:
        yield FAULTS, serialize.string(f"Störung {sample}")


def write_samples(writer: BagWriter, samples: range, topics: Sequence[Topic] = TOPICS) -> Messages:
    """Write control cycles; the log times rise from message to message."""
    written: Messages = defaultdict(list)
    for sample in samples:
        for index, (topic, data) in enumerate(sample_messages(sample)):
            if topic not in topics:
                continue
            log_time = sample_stamp_ns(sample, RATE_HZ) + 1000 * index
            writer.write(topic, log_time, data, log_time - 500)
            written[absolute_name(topic)].append((log_time, log_time - 500, data))
    return written


def merged(*parts: Messages) -> Messages:
    return {name: [m for part in parts for m in part.get(name, [])] for part in parts for name in part}


def read_with_rosbags(directory: Path) -> Messages:
    found: Messages = defaultdict(list)
    with Reader(directory) as reader:
        for connection, log_time, data in reader.messages():
            found[connection.topic].append((log_time, log_time - 500, bytes(data)))
    return found


def read_with_mcap(directory: Path) -> Messages:
    found: Messages = defaultdict(list)
    with next(directory.glob("*.mcap")).open("rb") as stream:
        for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            found[channel.topic].append((message.log_time, message.publish_time, message.data))
    return found


def scan_with_mcap(directory: Path) -> Messages:
    """Read without the index, from the first byte to the last, as a stream."""
    found: Messages = defaultdict(list)
    with next(directory.glob("*.mcap")).open("rb") as stream:
        for _, channel, message in NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False):
            found[channel.topic].append((message.log_time, message.publish_time, message.data))
    return found


def metadata_of(directory: Path) -> dict[str, Any]:
    metadata: dict[str, Any] = yaml.safe_load((directory / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    return metadata


def assert_bag_holds(directory: Path, expected: Messages) -> None:
    assert read_with_rosbags(directory) == expected
    assert read_with_mcap(directory) == expected
    assert scan_with_mcap(directory) == expected
    metadata = metadata_of(directory)
    counts = {
        entry["topic_metadata"]["name"]: entry["message_count"] for entry in metadata["topics_with_message_count"]
    }
    assert {name: count for name, count in counts.items() if count} == {n: len(m) for n, m in expected.items()}
    assert metadata["message_count"] == metadata["files"][0]["message_count"] == sum(map(len, expected.values()))


@pytest.fixture
def bag(tmp_path: Path) -> tuple[Path, Messages]:
    """A closed bag of 250 control cycles with a checkpoint in the middle."""
    directory = tmp_path / "run"
    with BagWriter(directory, TOPICS) as writer:
        first = write_samples(writer, range(100))
        writer.checkpoint()
        written = merged(first, write_samples(writer, range(100, 250)))
        writer.close({"dropped": "3", "note": 'a "quoted": name\nand ü'})
    return directory, written


def test_every_reader_gets_back_every_byte(bag: tuple[Path, Messages]) -> None:
    assert_bag_holds(*bag)


def test_metadata_is_that_of_a_jazzy_recording(bag: tuple[Path, Messages]) -> None:
    directory, written = bag
    metadata = metadata_of(directory)
    times = [log_time for messages in written.values() for log_time, _, _ in messages]
    span = {
        "starting_time": {"nanoseconds_since_epoch": min(times)},
        "duration": {"nanoseconds": max(times) - min(times)},
    }
    assert metadata["version"] == 9
    assert metadata["storage_identifier"] == "mcap"
    assert metadata["ros_distro"] == "jazzy"
    assert metadata["compression_format"] == metadata["compression_mode"] == ""
    assert metadata["relative_file_paths"] == ["run_0.mcap"]
    assert {key: metadata[key] for key in span} == span
    assert metadata["files"] == [{"path": "run_0.mcap", **span, "message_count": len(times)}]
    assert metadata["custom_data"] == {"dropped": "3", "note": 'a "quoted": name\nand ü'}

    topics = {
        entry["topic_metadata"]["name"]: entry["topic_metadata"] for entry in metadata["topics_with_message_count"]
    }
    assert list(topics) == [absolute_name(topic) for topic in TOPICS]
    forever = {"sec": 9223372036, "nsec": 854775807}
    assert topics["/faults"] == {
        "name": "/faults",
        "type": "std_msgs/msg/String",
        "serialization_format": "cdr",
        "offered_qos_profiles": [
            {
                "history": "keep_last",
                "depth": FAULTS.qos.depth,
                "reliability": "reliable",
                "durability": "transient_local",
                "deadline": forever,
                "lifespan": forever,
                "liveliness": "automatic",
                "liveliness_lease_duration": forever,
                "avoid_ros_namespace_conventions": False,
            }
        ],
        "type_description_hash": type_hash("std_msgs/msg/String"),
    }


def test_type_hash_is_that_of_the_ros_release() -> None:
    # As the type support of sensor_msgs 5.3 for ROS 2 Jazzy reports it.
    expected = "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    assert type_hash("sensor_msgs/msg/JointState") == expected


def test_mcap_file_explains_itself(bag: tuple[Path, Messages]) -> None:
    directory, _ = bag
    with (directory / "run_0.mcap").open("rb") as stream:
        reader = make_reader(stream)
        records = {record.name: record.metadata for record in reader.iter_metadata()}
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2"
    assert records[RECORDING_RECORD]["dropped"] == "3"
    assert yaml.safe_load(records["rosbag2"]["serialized_metadata"]) == metadata_of(directory)
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == metadata_of(directory)["message_count"]
    channel = next(channel for channel in summary.channels.values() if channel.topic == "/joint_states")
    schema = summary.schemas[channel.schema_id]
    assert (schema.name, schema.encoding) == ("sensor_msgs/msg/JointState", "ros2msg")
    assert b"float64[] position" in schema.data
    assert channel.message_encoding == "cdr"
    assert channel.metadata["topic_type_hash"] == type_hash("sensor_msgs/msg/JointState")
    assert yaml.safe_load(channel.metadata["offered_qos_profiles"])[0]["depth"] == JOINT_STATES.qos.depth


def test_messages_decode_from_the_schemas_in_the_file(bag: tuple[Path, Messages]) -> None:
    decoder = pytest.importorskip("mcap_ros2.decoder")
    directory, written = bag
    with (directory / "run_0.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
        decoded = [found.decoded_message for found in reader.iter_decoded_messages(topics=["/joint_states"])]
    assert len(decoded) == len(written["/joint_states"])
    assert list(decoded[7].name) == list(JOINTS)
    assert np.array(decoded[7].position).tobytes() == np.array(awkward(7, 4)).tobytes()


def test_recording_gives_arrays_with_every_bit(bag: tuple[Path, Messages]) -> None:
    directory, written = bag
    recording = read_bag(directory)
    stamps = [sample_stamp_ns(sample, RATE_HZ) for sample in range(250)]
    assert recording.custom_data["dropped"] == "3"
    assert recording.topics == tuple(absolute_name(topic) for topic in TOPICS)
    assert recording.count(JOINT_STATES) == 250
    assert recording.joint_names(JOINT_STATES) == JOINTS
    assert recording.stamps(JOINT_STATES).tolist() == recording.stamps(IMU_DATA).tolist() == stamps
    assert recording.log_times(SUPERVISOR_SIGMA).tolist() == [m[0] for m in written["/supervisor/sigma"]]

    position = recording.field(JOINT_STATES, "position")
    assert position.shape == (250, 4)
    assert position.dtype == np.dtype(np.float64)
    assert position.tobytes() == np.array([awkward(sample, 4) for sample in range(250)]).tobytes()
    assert recording.field(JOINT_STATES, "velocity").shape == (250, 0)
    acceleration = recording.field(IMU_DATA, "linear_acceleration")
    assert acceleration.tobytes() == np.array([awkward(sample + 2, 3) for sample in range(250)]).tobytes()
    assert recording.field(IMU_DATA, "angular_velocity").shape == (250, 3)
    assert recording.field(IMU_DATA, "orientation").tolist() == [[0.0, 0.0, 0.0, 1.0]] * 250
    sigma = recording.field(SUPERVISOR_SIGMA, "data")
    assert sigma.tobytes() == np.array([awkward(sample, 1)[0] for sample in range(250)]).tobytes()
    assert recording.texts(FAULTS) == ["Störung 0", "Störung 100", "Störung 200"]
    assert recording.texts(RUN_STATUS) == []


def test_recording_says_what_it_does_not_have(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run", [JOINT_STATES, FAULTS, RUN_STATUS, IMU_ERROR, TORQUE_COMMAND]) as writer:
        writer.write(RUN_STATUS, 0, serialize.string("done"))
        writer.write(JOINT_STATES, 1, serialize.joint_state(1, ["q11"], [1.0]))
        writer.write(JOINT_STATES, 2, serialize.joint_state(2, ["q21"], [1.0]))
        writer.write(TORQUE_COMMAND, 3, serialize.joint_state(3, ["q11"], effort=[1.0]))
        writer.write(TORQUE_COMMAND, 4, serialize.joint_state(4, ["q11"], effort=[1.0, 2.0]))
        writer.write(IMU_ERROR, 5, serialize.float64(1.0)[:9])
    recording = read_bag(tmp_path / "run")
    assert recording.count(IMU_DATA) == 0
    requests: list[tuple[str, Callable[[], object]]] = [
        ("/imu/data: not in the bag", lambda: recording.stamps(IMU_DATA)),
        ("/faults: its messages have no numbers called data", lambda: recording.field(FAULTS, "data")),
        ("/faults: its messages have no joint names", lambda: recording.joint_names(FAULTS)),
        ("/run/status: its messages have no stamp", lambda: recording.stamps(RUN_STATUS)),
        ("/joint_states: its messages are not texts", lambda: recording.texts(JOINT_STATES)),
        ("/joint_states: names change within", lambda: recording.field(JOINT_STATES, "position")),
        ("/torque_command: effort has not the same number", lambda: recording.field(TORQUE_COMMAND, "effort")),
        ("/imu/acceleration_error: a message cannot be decoded", lambda: recording.field(IMU_ERROR, "data")),
        ("recorded as std_msgs/msg/String", lambda: recording.stamps(FAULTS._replace(type=IMU_DATA.type))),
    ]
    for what, request in requests:
        with pytest.raises(BagError, match=what) as caught:
            request()
        assert str(caught.value).startswith(f"{tmp_path / 'run'}: ")
        assert "\n" not in str(caught.value)


def test_messages_of_others_are_left_out_and_counted(tmp_path: Path) -> None:
    """Whoever publishes on a topic is recorded; the graph's own messages are read all the same."""
    still = (0.0, 0.0)
    strays = [
        serialize.joint_state(1, ["q11"] * 300, effort=[1.0] * 300),
        serialize.joint_state(1, ["q11", "q22"], effort=still),
        serialize.joint_state(1, ["q11", "q21"], effort=[1.0]),
        serialize.joint_state(1, ["q11", "q21"]),
        serialize.joint_state(1, ["q11", "q21"], effort=still)[:40],
        b"",
    ]
    with BagWriter(tmp_path / "run", [TORQUE_COMMAND, RUN_EPOCH]) as writer:
        for number, stray in enumerate(strays):
            writer.write(TORQUE_COMMAND, 10 * number, stray)
            writer.write(
                TORQUE_COMMAND, 10 * number + 1, serialize.joint_state(number, ["q11", "q21"], effort=[number, -1.0])
            )
        writer.write(TORQUE_COMMAND, 90, serialize.joint_state(90, ["q21", "q11"], still, effort=[-1.0, 90.0]))
        for text in ("[" * 5000, '{"epoch_ns": 5}', "x"):
            writer.write(RUN_EPOCH, 95, serialize.string(text))
    recording = read_bag(tmp_path / "run")
    assert recording.stamps(TORQUE_COMMAND).tolist() == [0, 1, 2, 3, 4, 5, 90]
    assert recording.log_times(TORQUE_COMMAND).tolist() == [1, 11, 21, 31, 41, 51, 90]
    assert recording.field(TORQUE_COMMAND, "effort").tolist() == [[number, -1.0] for number in (0, 1, 2, 3, 4, 5, 90)]
    assert np.isnan(recording.field(TORQUE_COMMAND, "position")).tolist() == [[True] * 2] * 6 + [[False] * 2]
    assert recording.epoch_ns(500) == 5
    assert recording.strays == len(strays)


PERIOD = 2_000_000
"""Time (ns) between two samples of the bags below."""


def with_stamps(directory: Path, topic: Topic, stamps: Sequence[int], epochs: Sequence[int] = ()) -> Recording:
    """Return a recording of messages that were logged a period apart and have these stamps, all with other values."""
    with BagWriter(directory, [topic, RUN_EPOCH]) as writer:
        for number, stamp in enumerate(stamps):
            if topic.type == IMU_DATA.type:
                data = serialize.imu(stamp, "imu", (0.0, 0.0, 0.1 * number), (0.0, 0.0, 9.8))
            else:
                data = serialize.joint_state(stamp, ACTIVE_JOINTS, (number, 0.0))
            writer.write(topic, number * PERIOD, data)
        for epoch in epochs:
            writer.write(RUN_EPOCH, len(stamps) * PERIOD, serialize.string(epoch_text(epoch)))
    return read_bag(directory)


@pytest.mark.parametrize(
    ("topic", "stamps", "expected"),
    [
        (MOTOR_STATES, [1000, 1001, 1002], None),
        # the clock is set by 1 s, when the third message would have had the stamp 1002
        (MOTOR_STATES, [1000, 1001, 502, 503], "its stamps go back by 1.000 s, 0.002 s after the first"),
        (MOTOR_STATES, [1000, 1001, 1002, 1503], "its stamps go forward by 1.000 s between two messages 0.002 s apart"),
        (MOTOR_STATES, [1000, 1001, 1001, 1002], "1 of 4 messages repeat the stamp before with other values, 0.002 s"),
        (IMU_DATA, [1000, 1001, 1001, 1002, 1002], "2 of 5 messages repeat the stamp before with other values"),
        (IMU_DATA, [1000, 1003, 1001, 1004], None),
        (IMU_DATA, [1000, 1001, 952, 953], "its stamps go back by 0.100 s"),
    ],
)
def test_stamps_that_do_not_rise_with_time_are_named(
    topic: Topic, stamps: Sequence[int], expected: str | None, tmp_path: Path
) -> None:
    step = with_stamps(tmp_path / "run", topic, [stamp * PERIOD for stamp in stamps]).clock_step(topic)
    assert step == expected or (expected is not None and f"/{topic.name}: {expected}" in str(step))


def test_a_message_that_is_published_again_is_no_clock_that_was_set(tmp_path: Path) -> None:
    """A plant repeats sample 0 until it is answered."""
    with BagWriter(tmp_path / "run", [MOTOR_STATES]) as writer:
        for number, stamp in enumerate((1, 1, 1, 2)):
            writer.write(MOTOR_STATES, number, serialize.joint_state(stamp, ACTIVE_JOINTS, (float(stamp), 0.0)))
    assert read_bag(tmp_path / "run").clock_step(MOTOR_STATES) is None


@pytest.mark.parametrize("foreign", [5 * NANOSECONDS, 150 * PERIOD, 60 * PERIOD, 77, None])
def test_a_foreign_epoch_leaves_the_samples_as_they_are(foreign: int | None, tmp_path: Path) -> None:
    """Beyond the samples, among them, before them on their grid, off the grid, and of no run."""
    begin = 100 * PERIOD
    stamps = [begin + number * PERIOD for number in range(90)]
    recording = with_stamps(tmp_path / "run", MOTOR_STATES, stamps, [begin, *([] if foreign is None else [foreign])])
    assert recording.epoch_ns(500) == begin
    assert recording.samples(MOTOR_STATES, 500).tolist() == list(range(90))


def test_of_two_runs_in_a_bag_the_last_one_is_read(tmp_path: Path) -> None:
    first, second = (begin * PERIOD for begin in (100, 5000))
    stamps = [begin + number * PERIOD for begin in (first, second) for number in range(3)]
    recording = with_stamps(tmp_path / "run", MOTOR_STATES, stamps, [first, second])
    assert recording.samples(MOTOR_STATES, 500).tolist() == [-1, -1, -1, 0, 1, 2]


def test_values_are_taken_by_the_names_beside_them(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run", [PASSIVE_STATES, JOINT_STATES]) as writer:
        writer.write(PASSIVE_STATES, 1, serialize.joint_state(1, ("gripper", "q22", "q12"), (9.0, 2.2, 1.2)))
        for number, names in enumerate((JOINTS, JOINTS[::-1], (*JOINTS[2:], *JOINTS[:2])), start=1):
            angles = [float(name[1:]) for name in names]
            writer.write(JOINT_STATES, number, serialize.joint_state(number, names, angles))
    recording = read_bag(tmp_path / "run")
    assert recording.values(PASSIVE_STATES, "position", ("q22",)).tolist() == [[2.2]]
    assert recording.values(JOINT_STATES, "position", ("q21", "q12")).tolist() == [[21.0, 12.0]] * 3
    with pytest.raises(BagError, match="/passive_states: has no q21, only gripper, q22, q12"):
        recording.values(PASSIVE_STATES, "position", ("q21",))
    with pytest.raises(BagError, match="/joint_states: holds no velocity of its joints"):
        recording.values(JOINT_STATES, "velocity", JOINTS)


def test_joints_of_another_robot_are_left_out_and_no_strays(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run", [JOINT_STATES]) as writer:
        for number in range(3):
            writer.write(JOINT_STATES, number, serialize.joint_state(number, JOINTS, [0.1] * 4))
            writer.write(JOINT_STATES, number, serialize.joint_state(7, ["shoulder", "elbow"], [0.2] * 2))
        writer.write(JOINT_STATES, 9, serialize.joint_state(9, ["q11", "elbow"], [0.3] * 2))
    recording = read_bag(tmp_path / "run")
    assert recording.stamps(JOINT_STATES).tolist() == [0, 1, 2]
    assert recording.strays == 1


def test_names_are_absolute_in_the_namespace(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run", [JOINT_STATES], namespace="left/arm") as writer:
        writer.write(JOINT_STATES, 5, serialize.joint_state(5, JOINTS))
    assert read_bag(tmp_path / "run", namespace="/left/arm").topics == ("/left/arm/joint_states",)
    assert read_bag(tmp_path / "run", namespace="/left/arm/").count(JOINT_STATES) == 1
    assert read_bag(tmp_path / "run").count(JOINT_STATES) == 1
    for wrong, shown in (("", "/"), ("/left", "/left"), ("/arm", "/arm")):
        with pytest.raises(
            BagError, match=rf"has no robot in the namespace {shown}: expected /left/arm by --namespace"
        ):
            read_bag(tmp_path / "run", namespace=wrong)


def test_a_bag_of_several_robots_is_refused(tmp_path: Path) -> None:
    topics = [JOINT_STATES, JOINT_STATES._replace(name="left/joint_states")]
    with BagWriter(tmp_path / "run", topics):
        pass
    with pytest.raises(BagError, match="several namespaces, /, /left: expected one, by --namespace"):
        read_bag(tmp_path / "run")


def other_robot(stamp: int) -> bytes:
    return serialize.joint_state(stamp, ["shoulder", "elbow"], [1.0, 2.0])


def test_another_robot_beside_ours_is_passed_over(tmp_path: Path) -> None:
    """By the names of the joints, whatever the namespaces are and which of them comes first."""
    for number, (own, other) in enumerate((("", "ur5"), ("left", ""), ("ur5", "arm"))):
        path = tmp_path / str(number)
        theirs, ours = (Topic(f"/{name}/joint_states".replace("//", "/"), JOINT_STATES.type) for name in (other, own))
        with BagWriter(path, [theirs, ours]) as writer:
            writer.write(theirs, 1, other_robot(1))
            writer.write(ours, 2, serialize.joint_state(2, JOINTS, [0.1, 0.2, 0.3, 0.4]))
        assert read_bag(path).field(JOINT_STATES, "position").tolist() == [[0.1, 0.2, 0.3, 0.4]]
        with pytest.raises(BagError, match="joint_states: has no q11"):
            joint_columns(read_bag(path, other), JOINT_STATES, JOINTS, "position")


def test_joints_are_found_by_their_names_among_others(tmp_path: Path) -> None:
    """A gripper on the same topic, in messages of its own or in ours, and joints in another order."""
    path = tmp_path / "run"
    with BagWriter(path, [JOINT_STATES]) as writer:
        writer.write(JOINT_STATES, 5, serialize.joint_state(10, ["gripper"], [9.0]))
        writer.write(JOINT_STATES, 6, serialize.joint_state(11, JOINTS, [0.1, 0.2, 0.3, 0.4]))
        writer.write(JOINT_STATES, 7, serialize.joint_state(12, ["gripper"], [9.0]))
        mixed = ["gripper", "q22", "q21", "q12", "q11"]
        writer.write(
            JOINT_STATES, 8, serialize.joint_state(13, mixed, [9.0, 0.8, 0.7, 0.6, 0.5], (), [9.0, 4, 3, 2, 1])
        )
    bag = read_bag(path)
    assert bag.joint_names(JOINT_STATES) == JOINTS
    assert bag.stamps(JOINT_STATES).tolist() == [11, 13]
    assert bag.log_times(JOINT_STATES).tolist() == [6, 8]
    assert bag.field(JOINT_STATES, "position").tolist() == [[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]]


def test_other_stamped_messages_can_be_recorded_too(tmp_path: Path) -> None:
    diagnostics = Topic("diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    kind = TYPESTORE.types[diagnostics.type]
    header: Any = TYPESTORE.deserialize_cdr(serialize.joint_state(12_000_000_034, []), JOINT_STATES.type)
    with BagWriter(tmp_path / "run", [diagnostics]) as writer:
        writer.write(diagnostics, 1, bytes(TYPESTORE.serialize_cdr(kind(header.header, []), diagnostics.type)))
    assert read_bag(tmp_path / "run").stamps(diagnostics).tolist() == [12_000_000_034]


def test_existing_directory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    with pytest.raises(FileExistsError):
        BagWriter(tmp_path / "run", TOPICS)
    assert list((tmp_path / "run").iterdir()) == []


def test_misuse_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KeyError, match="no such message type"):
        BagWriter(tmp_path / "run", [Topic("x", "other_msgs/msg/Thing")])
    with pytest.raises(ValueError, match="a topic occurs twice"):
        BagWriter(tmp_path / "run", [FAULTS, FAULTS])
    assert not (tmp_path / "run").exists()
    writer = BagWriter(tmp_path / "run", [FAULTS])
    with pytest.raises(KeyError):
        writer.write(JOINT_STATES, 1, b"")
    writer.close({})
    writer.close({})
    with pytest.raises(ValueError, match="closed"):
        writer.write(FAULTS, 1, b"")
    with pytest.raises(ValueError, match="closed"):
        writer.checkpoint()


def test_bag_without_messages_is_a_bag(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run", TOPICS) as writer:
        assert_bag_holds(tmp_path / "run", {})
        writer.checkpoint()
        writer.close({"dropped": "0"})
    assert_bag_holds(tmp_path / "run", {})
    recording = read_bag(tmp_path / "run")
    assert recording.custom_data == {"dropped": "0"}
    assert recording.field(JOINT_STATES, "position").shape == (0, 0)
    assert recording.field(IMU_DATA, "linear_acceleration").shape == (0, 3)
    assert recording.stamps(SUPERVISOR_STATE).shape == recording.field(SUPERVISOR_SIGMA, "data").shape == (0,)


@pytest.mark.extra
def test_each_checkpoint_leaves_a_complete_bag(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run", TOPICS)
    written: Messages = {}
    for step in range(6):
        written = merged(written, write_samples(writer, range(40 * step, 40 * step + 40)))
        assert writer.message_count == sum(map(len, written.values()))
        writer.checkpoint()
        copy = shutil.copytree(tmp_path / "run", tmp_path / f"copy{step}")
        assert_bag_holds(copy, written)
    assert read_bag(tmp_path / "run").custom_data == {}
    writer.close({"dropped": "0"})
    assert_bag_holds(tmp_path / "run", written)
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["metadata.yaml", "run_0.mcap"]


@pytest.mark.extra
def test_bag_is_readable_between_any_two_pages_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kill can strike after every page that the kernel has copied; look at the bag at each of these moments."""
    directory, moments = tmp_path / "run", tmp_path / "moments"
    pwrite, ftruncate, replace = os.pwrite, os.ftruncate, os.replace
    taken: list[Path] = []

    def look() -> None:
        taken.append(shutil.copytree(directory, moments / str(len(taken))))

    def pwrite_by_pages(fd: int, data: memoryview, offset: int) -> int:
        done = 0
        while done < len(data):
            page = data[done : done + PAGE - (offset + done) % PAGE]
            done += pwrite(fd, page, offset + done)
            look()
        return done

    def ftruncate_and_look(fd: int, size: int) -> None:
        ftruncate(fd, size)
        look()

    def replace_and_look(source: Path, target: Path) -> None:
        look()
        replace(source, target)
        look()

    topics = (JOINT_STATES, IMU_DATA, FAULTS)
    writer = BagWriter(directory, topics)
    monkeypatch.setattr(os, "pwrite", pwrite_by_pages)
    monkeypatch.setattr(os, "ftruncate", ftruncate_and_look)
    monkeypatch.setattr(os, "replace", replace_and_look)
    states: list[Messages] = [{}]
    first_moment = []
    for step in range(4):
        samples = range(150 * step, 150 * step + 150)
        states.append(merged(states[-1], write_samples(writer, samples, topics)))
        first_moment.append(len(taken))
        writer.checkpoint()
    first_moment.append(len(taken))
    writer.close({"dropped": "0"})

    assert len(taken) > 40
    for index, moment in enumerate(taken):
        step = sum(index >= first for first in first_moment)
        found = read_with_rosbags(moment)
        assert found == read_with_mcap(moment)
        assert found in states[step - 1 : step + 1]
        with Reader(moment) as reader:
            assert reader.message_count <= sum(map(len, found.values()))


KILLED = """
import sys
from pathlib import Path
from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_description.interface import JOINT_STATES, JOINTS, TOPICS, sample_stamp_ns

writer = BagWriter(Path(sys.argv[1]), TOPICS)
sample = 0
while True:
    for _ in range(50):
        stamp = sample_stamp_ns(sample, 500)
        writer.write(JOINT_STATES, stamp, serialize.joint_state(stamp, JOINTS, [sample] * 4))
        sample += 1
    writer.checkpoint()
    print(sample, flush=True)
"""


@pytest.mark.parametrize("lines", [1, 2, 5, 23, 60])
def test_kill_costs_at_most_what_came_after_the_last_checkpoint(tmp_path: Path, lines: int) -> None:
    directory = tmp_path / "run"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(directory)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for _ in range(lines):
        process.stdout.readline()
    process.kill()
    saved = int((f"{50 * lines}\n" + process.stdout.read()).split("\n")[-2])
    process.stdout.close()
    assert process.wait() == -signal.SIGKILL

    recording = read_bag(directory)
    count = recording.count(JOINT_STATES)
    assert count in (saved, saved + 50)
    assert recording.field(JOINT_STATES, "position")[:, 3].tolist() == list(range(count))
    assert len(read_with_mcap(directory)["/joint_states"]) == count


FULL = """
import resource, signal, sys
from pathlib import Path
from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_description.interface import JOINT_STATES, JOINTS, TOPICS

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
limit = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
writer = BagWriter(Path(sys.argv[1]), TOPICS)
sample = saved = 0
error = None
while error is None:
    for _ in range(200):
        writer.write(JOINT_STATES, sample, serialize.joint_state(sample, JOINTS, [sample / 3] * 4))
        sample += 1
    try:
        writer.checkpoint()
        saved = sample
    except OSError as caught:
        error = caught
print(saved, sample, error.errno, flush=True)
if len(sys.argv) > 3:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    writer.checkpoint()
"""


def fill(directory: Path, *arguments: str) -> tuple[int, int, int]:
    """Record until the file may not grow any more; return messages saved and written, and the error's number."""
    command = [sys.executable, "-c", FULL, str(directory), *arguments]
    saved, written, number = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    return int(saved), int(written), int(number)


@pytest.mark.parametrize("limit", [40_000, 65_536, 100_001])
def test_full_disk_is_an_oserror_and_the_bag_keeps_the_last_checkpoint(tmp_path: Path, limit: int) -> None:
    saved, written, number = fill(tmp_path / "run", str(limit))
    assert number == errno.EFBIG
    assert 0 < saved < written
    assert read_bag(tmp_path / "run").count(JOINT_STATES) == saved
    assert read_with_mcap(tmp_path / "run") == scan_with_mcap(tmp_path / "run")


def test_recording_goes_on_when_there_is_room_again(tmp_path: Path) -> None:
    _, written, _ = fill(tmp_path / "run", "40000", "more")
    assert read_bag(tmp_path / "run").count(JOINT_STATES) == written
    assert read_with_mcap(tmp_path / "run") == scan_with_mcap(tmp_path / "run")


@pytest.mark.parametrize("failing_call", range(5))
def test_error_in_any_step_leaves_the_last_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing_call: int
) -> None:
    """The disk runs full within each of the steps of a checkpoint, halfway through what that step writes."""
    pwrite, ftruncate = os.pwrite, os.ftruncate
    calls = iter(range(100))

    def failing_pwrite(fd: int, data: memoryview, offset: int) -> int:
        if next(calls) == failing_call:
            pwrite(fd, data[: len(data) // 2], offset)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return pwrite(fd, data, offset)

    def failing_ftruncate(fd: int, size: int) -> None:
        if next(calls) == failing_call:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        ftruncate(fd, size)

    writer = BagWriter(tmp_path / "run", TOPICS)
    first = write_samples(writer, range(100))
    writer.checkpoint()
    second = write_samples(writer, range(100, 200))
    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", failing_pwrite)
        patch.setattr(os, "ftruncate", failing_ftruncate)
        with pytest.raises(OSError):
            writer.checkpoint()
    assert_bag_holds(tmp_path / "run", first)
    writer.close({"dropped": "0"})
    assert_bag_holds(tmp_path / "run", merged(first, second))


def test_unwritable_place_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError):
        BagWriter(tmp_path / "file" / "run", TOPICS)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("failing_call", range(2))
def test_full_disk_at_the_start_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing_call: int
) -> None:
    full_at(monkeypatch, failing_call)
    with pytest.raises(OSError, match="No space left"):
        BagWriter(tmp_path / "run", TOPICS)
    assert list(tmp_path.iterdir()) == []


def test_error_in_the_with_block_is_not_hidden_and_keeps_the_messages(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="elsewhere"), BagWriter(tmp_path / "run", TOPICS) as writer:
        written = write_samples(writer, range(3))
        raise RuntimeError("elsewhere")
    assert_bag_holds(tmp_path / "run", written)


def truncate(path: Path, size: int) -> None:
    os.truncate(path, size)


def damage(path: Path, offset: int) -> None:
    content = bytearray(path.read_bytes())
    content[offset] ^= 0xFF
    path.write_bytes(content)


def replace_by_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def replace_by_device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def with_nameless_topic(path: Path) -> None:
    """Have the metadata promise no messages, of a single topic that has no name."""
    topic = "{topic_metadata: {name: , type: a/msg/B, serialization_format: cdr}, message_count: 0}"
    text = (path / "metadata.yaml").read_text()
    text = re.sub(r"(?ms)^  message_count: .*?^  compression_format", "  message_count: 0\n  compression_format", text)
    text += f"  topics_with_message_count: [{topic}]\n"
    (path / "metadata.yaml").write_text(text)


@pytest.mark.parametrize(
    "break_bag",
    [
        pytest.param(shutil.rmtree, id="no directory"),
        pytest.param(lambda run: (run / "metadata.yaml").unlink(), id="no metadata"),
        pytest.param(lambda run: (run / "metadata.yaml").write_text(""), id="empty metadata"),
        pytest.param(lambda run: (run / "metadata.yaml").write_text("a: [b"), id="no YAML"),
        pytest.param(lambda run: (run / "run_0.mcap").unlink(), id="no file"),
        pytest.param(lambda run: truncate(run / "run_0.mcap", 0), id="empty file"),
        pytest.param(lambda run: truncate(run / "run_0.mcap", 20), id="only a beginning"),
        pytest.param(lambda run: truncate(run / "run_0.mcap", 3000), id="no index"),
        pytest.param(lambda run: truncate(run / "run_0.mcap", (run / "run_0.mcap").stat().st_size - 1), id="one byte"),
        pytest.param(lambda run: damage(run / "run_0.mcap", 2000), id="damaged data"),
        pytest.param(
            lambda run: (run / "metadata.yaml").write_text(
                re.sub(r"(?m)^(  message_count: )(\d+)$", r"\g<1>9\g<2>", (run / "metadata.yaml").read_text(), count=1)
            ),
            id="fewer messages",
        ),
        pytest.param(with_nameless_topic, id="a topic without a name"),
        pytest.param(lambda run: replace_by_pipe(run / "run_0.mcap"), id="a pipe"),
        pytest.param(lambda run: replace_by_pipe(run / "metadata.yaml"), id="metadata that is a pipe"),
        pytest.param(lambda run: replace_by_device(run / "run_0.mcap"), id="a device"),
        pytest.param(lambda run: replace_by_device(run / "metadata.yaml"), id="metadata that is a device"),
    ],
)
def test_broken_bag_is_one_line_that_names_it(bag: tuple[Path, Messages], break_bag: Callable[[Path], object]) -> None:
    directory, _ = bag
    break_bag(directory)
    with pytest.raises(BagError) as caught:
        read_bag(directory)
    message = str(caught.value)
    assert message.startswith(str(directory))
    assert "\n" not in message
    assert len(message.split(": ", 1)[1]) > 10


def test_a_length_beyond_the_memory_is_called_damage(bag: tuple[Path, Messages]) -> None:
    directory, _ = bag
    file = directory / "run_0.mcap"
    data = file.read_bytes()
    # the first record, after eight bytes of magic: its kind, then its length in eight bytes
    file.write_bytes(data[:9] + (2**62).to_bytes(8, "little") + data[17:])
    with pytest.raises(BagError, match=r"a length in it is beyond this machine's memory, as in damaged files$"):
        read_bag(directory)


def test_serialized_messages_have_the_layout_of_cdr() -> None:
    encapsulation = b"\x00\x01\x00\x00"
    assert serialize.float64(-0.0) == encapsulation + struct.pack("<d", -0.0)
    assert serialize.string("ü") == encapsulation + struct.pack("<I", 3) + "ü\0".encode()
    assert serialize.joint_state(1_000_000_002, ["q11"], effort=[0.1]) == encapsulation + struct.pack(
        "<iI I10s2x I I4s I I I d", 1, 2, 10, b"base_link\0", 1, 4, b"q11\0", 0, 0, 1, 0.1
    )


def test_imu_says_that_it_has_no_orientation() -> None:
    plain: Any = TYPESTORE.deserialize_cdr(serialize.imu(7, "tip", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), IMU_DATA.type)
    assert plain.header.frame_id == "tip"
    assert (plain.header.stamp.sec, plain.header.stamp.nanosec) == (0, 7)
    assert plain.orientation_covariance[0] == -1.0
    assert plain.angular_velocity.z == 3.0
    assert plain.linear_acceleration.x == 4.0
    full = serialize.imu(7, "tip", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (1.0, 0.0, 0.0, 0.0), [0.5] * 9, [0.25] * 9)
    known: Any = TYPESTORE.deserialize_cdr(full, IMU_DATA.type)
    assert known.orientation.x == 1.0
    assert known.orientation_covariance.tolist() == [0.0] * 9
    assert known.angular_velocity_covariance.tolist() == [0.5] * 9
    assert known.linear_acceleration_covariance.tolist() == [0.25] * 9
    with pytest.raises(ValueError, match="9 values"):
        serialize.imu(7, "tip", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), linear_acceleration_covariance=[1.0])


def test_rclpy_decodes_what_was_serialized_here() -> None:
    serialization = pytest.importorskip("rclpy.serialization")
    sensor_msgs = pytest.importorskip("sensor_msgs.msg")
    std_msgs = pytest.importorskip("std_msgs.msg")
    stamp = sample_stamp_ns(12_345, RATE_HZ)
    state = serialization.deserialize_message(
        serialize.joint_state(stamp, JOINTS, awkward(0, 4), awkward(1, 4), awkward(2, 4)), sensor_msgs.JointState
    )
    assert (state.header.stamp.sec, state.header.stamp.nanosec) == divmod(stamp, 10**9)
    assert state.name == list(JOINTS)
    for found, expected in ((state.position, 0), (state.velocity, 1), (state.effort, 2)):
        assert found.tobytes() == np.array(awkward(expected, 4)).tobytes()
    imu = serialization.deserialize_message(
        serialize.imu(stamp, "end_effector", awkward(0, 3), (1.0, 2.0, 3.0)), sensor_msgs.Imu
    )
    assert imu.header.frame_id == "end_effector"
    assert imu.linear_acceleration.z == 3.0
    assert np.isnan(imu.angular_velocity.z)
    assert imu.orientation_covariance[0] == -1.0
    assert serialization.deserialize_message(serialize.float64(0.1), std_msgs.Float64).data == 0.1
    assert serialization.deserialize_message(serialize.string("Störung"), std_msgs.String).data == "Störung"
