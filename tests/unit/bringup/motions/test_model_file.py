# SPDX-License-Identifier: Apache-2.0
"""Models of a robot for tools of others: they move as the plant does, and begin with the loop closed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yaml
from engine_agreement import changed
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.motions.model_file import model_text
from fivebar_bringup.motions.model_format import ModelFormat
from fivebar_bringup.runs.description import described_robot
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.interface import JOINTS
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import read_robot, robot_path
from fivebar_description.sdf import LOOP_JOINT


def frictionless(folder: Path) -> str:
    """A robot whose friction is its offset alone: MuJoCo has Coulomb's friction, not the smooth one of the model."""
    content = yaml.safe_load(robot_path("dextar").read_text(encoding="utf-8"))
    content["friction"] |= {"f_s11": 0.0, "f_s21": 0.0}
    path = folder / "frictionless.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(path)


@pytest.mark.extra
def test_mujoco_crosses_with_the_file_alone_as_the_plant_does(tmp_path: Path) -> None:
    """The torques of a crossing and back, held for a sample each, from the posture that the file has."""
    scenario = changed("middle", {}, controller="unified", robot=frictionless(tmp_path))
    (tmp_path / "scenario.yaml").write_text(scenario.to_yaml(), encoding="utf-8")
    run, robot = simulate(scenario), scenario.actual_robot()
    assert run.faults == []
    path = tmp_path / "model.xml"
    words = ["model", "--scenario", str(tmp_path / "scenario.yaml"), "--format", "mjcf", "--out", str(path)]
    assert CliRunner().invoke(app, words).exit_code == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    far, spins = [], []
    for before, after in zip(run.samples, run.samples[1:], strict=False):
        data.actuator("q11").ctrl, data.actuator("q21").ctrl = before.command
        for _ in range(round(1.0 / scenario.rate_hz / model.opt.timestep)):
            mujoco.mj_step(model, data)
        state = state_from_joints(robot, *after.exact.position, *after.exact.velocity)
        far.append(np.hypot(*(data.site("tip_2").xpos[:2] - (state.x, state.y))))
        mujoco.mj_forward(model, data)
        spins.append(data.sensor("imu_gyro").data[2] - after.exact.velocity[2] - after.exact.velocity[3])
    assert len(far) == 1000
    assert 0.0 < max(far) < 1e-7
    assert np.abs(spins).max() < 1e-4


def test_the_motors_of_the_urdf_are_commanded_and_all_joints_are_read() -> None:
    done = CliRunner().invoke(app, ["model", "dextar", "--format", "urdf", "--plugin", "my_robot/Drives"])
    root = ElementTree.fromstring(done.stdout)
    (section,) = root.findall("ros2_control")
    assert section.findtext("hardware/plugin") == "my_robot/Drives"
    commanded = {joint.get("name"): joint.findall("command_interface") for joint in section.findall("joint")}
    assert {name: [one.get("name") for one in found] for name, found in commanded.items()} == {
        "q11": ["effort"],
        "q12": [],
        "q21": ["effort"],
        "q22": [],
    }
    for joint in section.findall("joint"):
        assert [one.get("name") for one in joint.findall("state_interface")] == ["position", "velocity"]
    begins = [float(str(one.text)) for one in section.findall("joint/state_interface/param")]
    file = read_robot("dextar")
    assert begins == list(inverse_geometry(file.five_bar(), (1, -1), *file.home_m))
    root.remove(section)
    # all else is what `fivebar urdf` prints
    told = ElementTree.fromstring(described_robot("dextar"))
    assert ElementTree.canonicalize(
        ElementTree.tostring(root, encoding="unicode"), strip_text=True
    ) == ElementTree.canonicalize(ElementTree.tostring(told, encoding="unicode"), strip_text=True)


class PoseGraph:
    """Where the frames of an SDF are."""

    def __init__(self, text: str) -> None:
        self._model = ElementTree.fromstring(text).findall("model")[0]
        self._elements = {
            one.get("name"): one for kind in ("link", "frame", "joint") for one in self._model.findall(kind)
        }

    def placed(self, name: str) -> Any:
        """The frame of this name, in that of the model."""
        element = self._elements[name]
        pose = element.find("pose")
        base = (pose.get("relative_to") if pose is not None else None) or element.get("attached_to")
        words = [float(word) for word in (pose.text or "").split()] if pose is not None else []
        values = np.array(words or [0.0] * 6)
        own = pin.SE3(pin.rpy.rpyToMatrix(*values[3:]), values[:3])
        return self.placed(base) * own if base else own


@pytest.mark.parametrize("robot", ["dextar", "unequal", "motkin"])
def test_the_loop_of_the_sdf_is_closed_where_it_is_loaded(robot: str) -> None:
    graph = PoseGraph(model_text(ModelFormat.SDF, robot))
    tip, platform = (graph.placed(name).translation for name in ("left_tip", "platform"))
    np.testing.assert_allclose(tip, platform, atol=1e-15)
    np.testing.assert_allclose(platform[:2], read_robot(robot).home_m, atol=1e-15)
    np.testing.assert_allclose(graph.placed(LOOP_JOINT).translation, platform, atol=1e-15)


@pytest.mark.extra
@pytest.mark.parametrize("robot", ["dextar", "motkin"])
def test_drake_reads_the_sdf_as_the_robot_that_the_urdf_is(robot: str) -> None:
    """With the parser of SDFormat itself; what does not close the loop has the mass matrix of the URDF."""
    plants = pytest.importorskip("pydrake.multibody.plant")
    parsing = pytest.importorskip("pydrake.multibody.parsing")

    def parsed(text: str) -> Any:
        plant = plants.MultibodyPlant(0.0)
        parser = parsing.Parser(plant)
        parser.SetStrictParsing()
        parser.AddModelsFromString(text, "sdf")
        return plant

    text = model_text(ModelFormat.SDF, robot)
    loop = parsed(text).GetJointByName(LOOP_JOINT)
    # a platform without mass is a frame of its link
    carrier = "platform" if robot == "dextar" else "right_distal"
    assert (loop.parent_body().name(), loop.child_body().name()) == ("left_distal", carrier)
    document = ElementTree.fromstring(text)
    (model,) = document.findall("model")
    model.remove(next(joint for joint in model.findall("joint") if joint.get("name") == LOOP_JOINT))
    tree = parsed(ElementTree.tostring(document, encoding="unicode"))
    tree.Finalize()
    context = tree.CreateDefaultContext()
    ends = [
        tree.GetBodyByName(body.name()).EvalPoseInWorld(context).multiply(frame.GetFixedPoseInBodyFrame())
        for body, frame in (
            (loop.parent_body(), loop.frame_on_parent()),
            (loop.child_body(), loop.frame_on_child()),
        )
    ]
    np.testing.assert_allclose(ends[0].translation(), ends[1].translation(), atol=1e-12)
    file = read_robot(robot)
    home = np.array(inverse_geometry(file.five_bar(), (1, -1), *file.home_m))
    ours = pin.buildModelFromXML(robot_description(file.five_bar(), file.name, weighed=file.weighed()))
    random = np.random.default_rng(3)
    for _ in range(5):
        turned = random.uniform(-1.0, 1.0, 4)
        for joint, angle in zip(JOINTS, turned, strict=True):
            tree.GetJointByName(joint).set_angle(context, angle)
        order = [tree.GetJointByName(joint).velocity_start() for joint in JOINTS]
        mass = tree.CalcMassMatrix(context)[np.ix_(order, order)]
        wanted = np.triu(pin.crba(ours, ours.createData(), home + turned))
        np.testing.assert_allclose(np.triu(mass), wanted, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["dextar", "--robot", "unequal"], "--robot: unequal: expected without the argument ROBOT, which is dextar"),
        (["--plugin", "mine/Drives"], "--plugin: mine/Drives: expected with --format urdf only"),
        (["--robot", "FILE"], "home_m: (0.0000, 0.9000) m: expected a place that both legs reach"),
        (["--out", "/nowhere/model.xml"], "/nowhere/model.xml: cannot be written"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words: list[str], told: str, tmp_path: Path) -> None:
    content = yaml.safe_load(robot_path("dextar").read_text(encoding="utf-8"))
    (tmp_path / "far.yaml").write_text(yaml.safe_dump(content | {"home_m": [0.0, 0.9]}), encoding="utf-8")
    done = CliRunner().invoke(app, ["model", *(one.replace("FILE", str(tmp_path / "far.yaml")) for one in words)])
    assert (done.exit_code, done.stdout) == (2, "")
    assert told in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_robot_is_named_alike_by_all_that_describe_one() -> None:
    by_option = CliRunner().invoke(app, ["urdf", "--robot", "unequal"])
    assert by_option.stdout == CliRunner().invoke(app, ["urdf", "unequal"]).stdout
    assert 'robot name="unequal"' in by_option.stdout


def limited(folder: Path) -> str:
    """A robot with motors of its own, whose motor 1 stops at 1 and at 2.5 rad, motor 2 nowhere; home is between."""
    content = yaml.safe_load(robot_path("dextar").read_text(encoding="utf-8"))
    content["drives"] = {"torque_limit": 1.25, "joint_speed_limit": 7.5}
    content["forbidden"] = [
        {"name": "stop", "q11": [2.5, 1.0 + 2.0 * math.pi]},
        {"name": "table", "q21": [0.0, 0.1], "y": [0.0, 0.05]},
    ]
    path = folder / "limited.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(path)


def test_the_limits_of_a_model_are_those_of_the_robot(tmp_path: Path) -> None:
    """Passive joints have no motor; what no file says limits nothing."""
    robot = limited(tmp_path)
    for text in (described_robot(robot), model_text(ModelFormat.URDF, robot)):
        model = pin.buildModelFromXML(text)
        np.testing.assert_allclose(model.effortLimit, [1.25, 0.0, 1.25, 0.0])
        np.testing.assert_allclose(model.velocityLimit[[0, 2]], 7.5)
        assert model.velocityLimit[[1, 3]].min() >= 1e9
        np.testing.assert_allclose((model.lowerPositionLimit[0], model.upperPositionLimit[0]), (1.0, 2.5))
    file = read_robot(robot)
    home = dict(zip(JOINTS, inverse_geometry(file.five_bar(), (1, -1), *file.home_m), strict=True))
    root = ElementTree.fromstring(model_text(ModelFormat.SDF, robot))
    limits = {
        joint.get("name"): {one.tag: float(str(one.text)) for one in joint.findall("axis/limit/*")}
        for joint in root.findall("model/joint")
    }
    motor = {"effort": 1.25, "velocity": 7.5}
    assert limits["q11"] == pytest.approx({**motor, "lower": 1.0 - home["q11"], "upper": 2.5 - home["q11"]})
    assert (limits["q21"], limits["q12"], limits["q22"]) == (motor, {}, {})


def test_the_sdf_tells_how_its_angles_become_those_of_the_urdf() -> None:
    file = read_robot("unequal")
    home = inverse_geometry(file.five_bar(), (1, -1), *file.home_m)
    told = ", ".join(f"{name} + {angle!r}" for name, angle in zip(JOINTS, home, strict=True))
    assert f"Those of the URDF and of joint_states are {told} (rad)" in model_text(ModelFormat.SDF, "unequal")
