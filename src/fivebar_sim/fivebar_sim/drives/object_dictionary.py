# SPDX-License-Identifier: Apache-2.0
"""The object dictionary of an emulated drive: the objects that CiA 301 and CiA 402 require of a cyclic torque drive."""

from __future__ import annotations

from canopen import objectdictionary as od
from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable

from fivebar_sim.drives.configuration import DriveFacts

INJECT = 0x2000
"""Manufacturer-specific object: writing a number injects a fault."""

PDO_INVALID = 1 << 31

MAPPED_OBJECTS = 4
"""Objects that one PDO may carry."""


def object_dictionary(facts: DriveFacts) -> ObjectDictionary:
    """Return the dictionary of one drive."""
    node = facts.node_id
    dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]
    dictionary.node_id = node
    for variable in (
        _variable("device type", 0x1000, od.UNSIGNED32, 0x00020192, access="ro"),
        _variable("error register", 0x1001, od.UNSIGNED8, 0, access="ro"),
        _variable("producer heartbeat time", 0x1017, od.UNSIGNED16, 0),
        _variable("inject fault", INJECT, od.UNSIGNED8, 0),
        _variable("abort connection option code", 0x6007, od.INTEGER16, 0),
        _variable("error code", 0x603F, od.UNSIGNED16, 0, access="ro"),
        _variable("controlword", 0x6040, od.UNSIGNED16, 0),
        _variable("statusword", 0x6041, od.UNSIGNED16, 0, access="ro"),
        _variable("quick stop option code", 0x605A, od.INTEGER16, 2),
        _variable("modes of operation", 0x6060, od.INTEGER8, 0),
        _variable("modes of operation display", 0x6061, od.INTEGER8, 0, access="ro"),
        _variable("position actual value", 0x6064, od.INTEGER32, 0, access="ro"),
        _variable("velocity actual value", 0x606C, od.INTEGER32, 0, access="ro"),
        _variable("target torque", 0x6071, od.INTEGER16, 0),
        _variable("max torque", 0x6072, od.UNSIGNED16, 1000),
        _variable("motor rated torque", 0x6076, od.UNSIGNED32, round(facts.rated_torque_nm * 1e3), access="ro"),
        _variable("torque actual value", 0x6077, od.INTEGER16, 0, access="ro"),
        _variable("supported drive modes", 0x6502, od.UNSIGNED32, 1 << 9, access="ro"),
    ):
        dictionary.add_object(variable)
    dictionary.add_object(
        _record("consumer heartbeat time", 0x1016, ODArray, [("heartbeat of the master", od.UNSIGNED32, 0, "rw")])
    )
    identity = [
        ("vendor", od.UNSIGNED32, facts.vendor, "ro"),
        ("product code", od.UNSIGNED32, facts.product, "ro"),
        ("revision", od.UNSIGNED32, 1, "ro"),
        ("serial number", od.UNSIGNED32, node, "ro"),
    ]
    dictionary.add_object(_record("identity", 0x1018, ODRecord, identity))
    period = [("mantissa", od.UNSIGNED8, 2, "rw"), ("power of ten", od.INTEGER8, -3, "rw")]
    dictionary.add_object(_record("interpolation time period", 0x60C2, ODRecord, period))
    for number, can_id in enumerate((0x200 + node, 0x300 + node)):
        _add_pdo(dictionary, "RPDO", 0x1400 + number, 0x1600 + number, can_id)
    # one more TPDO is enabled by default than the bridge needs, as on many drives
    for number, can_id in enumerate((0x180 + node, (0x280 + node) | PDO_INVALID, 0x380 + node)):
        _add_pdo(dictionary, "TPDO", 0x1800 + number, 0x1A00 + number, can_id)
    return dictionary


def _variable(name: str, index: int, kind: int, default: int, subindex: int = 0, access: str = "rw") -> ODVariable:
    variable = ODVariable(name, index, subindex)
    variable.data_type = kind
    variable.default = default
    variable.access_type = access
    return variable


def _record(
    name: str, index: int, kind: type[ODRecord] | type[ODArray], members: list[tuple[str, int, int, str]]
) -> ODRecord | ODArray:
    record = kind(name, index)
    record.add_member(_variable("highest subindex", index, od.UNSIGNED8, len(members), access="ro"))
    for subindex, (member, data_type, default, access) in enumerate(members, 1):
        record.add_member(_variable(member, index, data_type, default, subindex, access))
    return record


def _add_pdo(dictionary: ObjectDictionary, kind: str, communication: int, mapping: int, can_id: int) -> None:
    members = [("can id", od.UNSIGNED32, can_id, "rw"), ("transmission type", od.UNSIGNED8, 255, "rw")]
    dictionary.add_object(_record(f"{kind} {communication:04X}", communication, ODRecord, members))
    record = ODRecord(f"{kind} mapping {mapping:04X}", mapping)
    record.add_member(_variable("count", mapping, od.UNSIGNED8, 0))
    for subindex in range(1, MAPPED_OBJECTS + 1):
        record.add_member(_variable(f"object {subindex}", mapping, od.UNSIGNED32, 0, subindex))
    dictionary.add_object(record)
