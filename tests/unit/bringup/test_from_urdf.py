# SPDX-License-Identifier: Apache-2.0
"""Robot files from URDFs: one written from the bench's public facts, exported ones, and broken ones."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from described_bench import description
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.motions.model_file import model_text
from fivebar_bringup.motions.model_format import ModelFormat
from fivebar_bringup.robots.from_urdf import FoundRobot, loop_in_urdf, robot_from_urdf
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.errors import InputError
from fivebar_description.parameters import without_cogging
from fivebar_description.robot_file import RobotFile, load_robot
from fivebar_description.strict_yaml import parse_versioned, validate

PHI, PSI = math.pi / 2.0, (0.212053999999276, 2.511306362956145)
TIPS = {"tips": ("coupler_1_end", "coupler_2_end")}


def link(name: str, mass: float = 0.0, centre: float = 0.0, inertia: float = 0.0) -> str:
    if not mass:
        return f'<link name="{name}"/>'
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre} 0 0"/><mass value="{mass}"/>'
        f'<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(
    name: str, parent: str, child: str, xyz: str, turn: float = 0.0, kind: str = "revolute", axis: str = "0 0 1"
) -> str:
    limit = '<limit lower="-0.9" upper="0.9" effort="1" velocity="1"/>' if name.startswith("motor") else ""
    limit = limit or '<limit lower="-6" upper="6" effort="0" velocity="100"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="0 0 {turn}"/><axis xyz="{axis}"/>{limit if kind == "revolute" else ""}</joint>'
    )


def bench(**changed: str) -> str:
    """Return a URDF of the MOTKIN bench by its public facts, off centre and upright, with parts changed."""
    parts = {
        "world": link("world") + link("base"),
        "stand": '<joint name="stand" type="fixed"><parent link="world"/><child link="base"/>'
        '<origin xyz="0 0 0.3" rpy="1.5708 0 0.4"/></joint>',
        "near": link("crank_1", 0.0422, 0.00341, 1.354e-5) + link("crank_2", 0.0348, 0.00413, 1.249e-5),
        "far": link("coupler_1", 0.00837, 0.0487, 1.316e-5) + link("coupler_2", 0.00969, 0.0557, 1.629e-5),
        "ends": link("coupler_1_end") + link("coupler_2_end"),
        "motor_1": joint("motor_1", "base", "crank_1", "-0.0421006 0.0302628 0.01", PHI),
        "motor_2": joint("motor_2", "base", "crank_2", "0.0578994 0.0302628 0.01", PHI),
        "passive_1": joint("passive_1", "crank_1", "coupler_1", "0.06 0 0.004", PSI[0]),
        "passive_2": joint("passive_2", "crank_2", "coupler_2", "0.06 0 0.008", PSI[1]),
        "tip_1": joint("end_1", "coupler_1", "coupler_1_end", "0.1 0 0", kind="fixed"),
        "tip_2": joint("end_2", "coupler_2", "coupler_2_end", "0.1 0 0", kind="fixed"),
    }
    return f'<robot name="bench">{"".join((parts | changed).values())}</robot>'


def found_in(text: str) -> tuple[RobotFile, FoundRobot]:
    found = robot_from_urdf(text, "bench.urdf", "bench", TIPS)
    return validate(parse_versioned(found.text, "bench"), RobotFile, "bench"), found


def test_the_bench_is_read_from_its_facts() -> None:
    file, found = found_in(bench())
    shipped = load_robot("motkin")
    robot = file.five_bar()
    for leg, own in ((robot.leg1, shipped.leg1), (robot.leg2, shipped.leg2)):
        assert leg[:4] == pytest.approx(own[:4], rel=1e-9)
        assert leg.residual == pytest.approx(own.residual, rel=1e-9)
    assert robot.mass == pytest.approx(shipped.mass, rel=1e-12)
    assert (file.drives.torque_limit, file.drives.joint_speed_limit) == (1.0, 1.0)
    # the range of a crank is about the direction in which its joint is at 0
    first, second = file.forbidden
    assert first.q11 == pytest.approx((PHI + 0.9, PHI - 0.9 + math.tau))
    assert second.q21 == pytest.approx((PHI + 0.9, PHI - 0.9 + math.tau))
    assert f"# motor_1: zero_rad {PHI:.6f}"[:24] in found.text
    assert any(line.startswith("friction: 0 is written") for line in found.untold)
    assert any("torque constants" in line for line in found.untold)


def test_a_motor_that_turns_the_other_way_has_the_other_sign() -> None:
    _, found = found_in(bench(motor_2=joint("motor_2", "base", "crank_2", "0.0578994 0.0302628 0", PHI, axis="0 0 -1")))
    zeros = [line for line in found.text.splitlines() if "zero_rad" in line]
    assert [line.rpartition(" ")[2] for line in zeros[:2]] == ["+1", "-1"]
    assert "q21: [2.47079" in found.text


def test_the_bench_s_own_description_is_seen_from_above() -> None:
    """Its motors' axes point down: their joints turn clockwise, and leg 1 is the left one all the same."""
    names, legs, base = loop_in_urdf(description(), "bench.urdf", {})
    assert (names.passive, names.tips) == (("passive_1", "passive_2"), ("closing_tip_2", "closing_tip_1"))
    assert base == pytest.approx(0.1)
    for leg in legs:
        assert leg[:3] == pytest.approx((0.06, 0.1, PHI))
        assert leg.sign == -1


def test_a_centre_of_mass_beside_the_line_is_told() -> None:
    crooked = link("coupler_1", 0.00837, 0.0487, 1.316e-5).replace('xyz="0.0487 0 0"', 'xyz="0.0487 0.002 0"')
    _, found = found_in(bench(far=crooked + link("coupler_2", 0.00969, 0.0557, 1.629e-5)))
    assert any("what passive_1 moves is 2 mm beside its link's line" in line for line in found.untold)


@pytest.mark.parametrize("name", ["dextar", "motkin"])
def test_an_exported_robot_has_the_same_equations(name: str) -> None:
    """Torques without friction, whose offset and smoothing a URDF does not tell."""
    found = robot_from_urdf(model_text(ModelFormat.URDF, name), "robot.urdf", name, {})
    read = validate(parse_versioned(found.text, name), RobotFile, name).five_bar()
    own = without_cogging(load_robot(name))
    x, y = (0.01, 0.13) if name == "dextar" else (0.01, 0.11)
    for motion in ((0.0, 0.0, 1.0, 0.0), (0.3, -0.2, 0.0, 1.0), (-0.5, 0.4, 2.0, -3.0)):
        torques = [
            inverse_dynamics_of_platform(
                robot, state_from_platform(robot, (1, -1), x, y, *motion[:2]), *motion[2:], 0.0, 0.0
            )
            for robot in (own, read)
        ]
        assert torques[1] == pytest.approx(torques[0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "given", "reason"),
    [
        ("<robot", TIPS, "bench.urdf: is not XML"),
        ("<sdf/>", TIPS, "bench.urdf: <sdf>: expected a URDF"),
        (bench(), {}, "bench.urdf: frame closing_tip_2: is not there: expected as tips"),
        (bench(), {"tips": ("coupler_1_end", "crank_2")}, "frame crank_2: expected on the link that passive_2 moves"),
        (bench(motor_2="", passive_2="", tip_2=""), TIPS, "--motors: is missing"),
        (bench(passive_1="", tip_1=""), TIPS, "joint passive_1: is not there: expected --passive with two of"),
        (
            bench(passive_2=joint("passive_2", "crank_2", "coupler_2", "0.06 0 0", PSI[1], axis="0 1 0")),
            TIPS,
            "joint passive_2: its axis is not parallel to that of motor_1",
        ),
        (
            bench(passive_2=joint("passive_2", "base", "coupler_2", "0.06 0 0", PSI[1])),
            TIPS,
            "joint passive_2: expected on the link that motor_2 moves",
        ),
        (
            bench(tip_1=joint("end_1", "coupler_1", "coupler_1_end", "0 0 0", kind="fixed")),
            TIPS,
            "a link between motor_1 and coupler_1_end has no length",
        ),
        (
            bench(motor_2=joint("motor_2", "base", "crank_2", "0.9 0.0302628 0", PHI)),
            TIPS,
            "the URDF describes no five-bar that can be moved",
        ),
    ],
)
def test_what_is_no_five_bar_is_refused_with_the_reason(
    text: str, given: dict[str, tuple[str, str]], reason: str
) -> None:
    with pytest.raises(InputError) as refused:
        robot_from_urdf(text, "bench.urdf", "bench", given)
    assert reason in str(refused.value)


def test_the_command_writes_the_file_and_says_what_is_not_told(tmp_path: Path) -> None:
    urdf, path = tmp_path / "bench.urdf", tmp_path / "bench.yaml"
    urdf.write_text(bench(), encoding="utf-8")
    run = CliRunner().invoke
    arguments = ["robot", "new", str(path), "--urdf", str(urdf)]
    done = run(app, [*arguments, "--tips", "coupler_1_end,coupler_2_end"])
    assert done.exit_code == 0, done.output
    assert "not in the URDF: friction: 0 is written" in done.output
    assert load_robot(str(path)).leg1.proximal == pytest.approx(0.06)
    assert run(app, [*arguments, "--overwrite", "--tips", "one"]).exit_code == 2
    assert run(app, ["robot", "check", str(path), "--urdf", str(urdf)]).exit_code == 2
