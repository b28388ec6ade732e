# SPDX-License-Identifier: Apache-2.0
"""A robot as an MJCF file for simulators of others: the mechanism of the plant, with shapes, motors and sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree

from fivebar_description.imu import STANDARD_GRAVITY, ImuSettings
from fivebar_description.interface import ACTIVE_JOINTS, JOINTS
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_description import COLOURS, LAYERS, SIDES, link_shapes, xml_text
from fivebar_mujoco.mujoco_model import Details, mjcf_text
from fivebar_sim.effects.loads import Tilt, tilt_angle
from fivebar_sim.effects.settings import PlantSettings

Element = ElementTree.Element

STEP = 5e-4
"""Integration step (s): a crossing differs from that with a fifth of it by less than 1e-7 m."""


def mjcf_file(robot: FiveBar, tree: Element, home: Sequence[float], imu: ImuSettings, torque_limit: float) -> str:
    """Return the MJCF of a robot.

    Args:
        robot: its parameters.
        tree: its URDF, which has the shapes.
        home: angles of the four joints in the keyframe `home` (rad).
        imu: how the IMU is mounted.
        torque_limit: of both motors (Nm).

    Raises:
        InputError: no bodies have these parameters.
    """
    shapes = link_shapes(tree)

    def geoms(link: str, x: float, z: float) -> str:
        return "".join(_geom(shape, x, z) for shape in shapes[link])

    legs = (robot.leg1, robot.leg2)
    fixed = geoms("base_link", 0.0, 0.0) + "".join(
        geoms(f"{side}_motor", leg.base_x, 0.0) for side, leg in zip(SIDES, legs, strict=True)
    )
    proximal = [geoms(f"{side}_proximal", 0.0, z) for side, z in zip(SIDES, LAYERS.proximal, strict=True)]
    left, right = (geoms(f"{side}_distal", 0.0, z) for side, z in zip(SIDES, LAYERS.distal, strict=True))
    place = (robot.leg2.distal + imu.mount_x, imu.mount_y, LAYERS.tool)
    sensor = f'\n        <site name="imu" pos="{_words(place)}" euler="{_words((imu.roll, imu.pitch, imu.yaw))}"/>'
    details = Details(
        name=tree.get("name", ""),
        friction=(_friction(robot.leg1.coulomb), _friction(robot.leg2.coulomb)),
        fixed=fixed,
        proximal=(proximal[0], proximal[1]),
        distal=(left, right + geoms("platform", robot.leg2.distal, LAYERS.tool) + sensor),
        sections=_sections((robot.leg1.offset, robot.leg2.offset), home, torque_limit),
        gravity=-STANDARD_GRAVITY * math.cos(tilt_angle(robot, Tilt())),
    )
    return xml_text(ElementTree.fromstring(mjcf_text(robot, PlantSettings(), STEP, details)))


def _friction(coulomb: float) -> str:
    return f' frictionloss="{coulomb!r}"' if coulomb > 0.0 else ""


def _sections(offsets: tuple[float, float], home: Sequence[float], limit: float) -> str:
    """Return motors, whose torque has the offset of friction taken off, sensors and the posture at rest."""
    motors = "".join(
        f"""
    <general name="{joint}" joint="{joint}" biastype="affine" biasprm="{-offset!r} 0 0"
             ctrlrange="{-limit!r} {limit!r}"/>"""
        for joint, offset in zip(ACTIVE_JOINTS, offsets, strict=True)
    )
    sensors = "".join(
        f"""
    <jointpos name="{joint}_position" joint="{joint}"/>
    <jointvel name="{joint}_velocity" joint="{joint}"/>"""
        for joint in JOINTS
    )
    return f"""
  <compiler angle="radian" eulerseq="XYZ"/>
  <actuator>{motors}
  </actuator>
  <sensor>{sensors}
    <framepos name="platform_position" objtype="site" objname="tip_2"/>
    <gyro name="imu_gyro" site="imu"/>
    <accelerometer name="imu_accelerometer" site="imu"/>
  </sensor>
  <keyframe>
    <key name="home" qpos="{_words(home)}"/>
  </keyframe>"""


def _geom(visual: Element, x: float, z: float) -> str:
    """Return a shape of the URDF as a geom that touches nothing and weighs nothing."""
    (shape,) = visual.findall("geometry/*")
    colour = COLOURS[visual.findall("material")[0].get("name", "")]
    at_x, at_y, at_z = _numbers(visual.findall("origin")[0].get("xyz", ""))
    if shape.tag == "box":
        size = [0.5 * length for length in _numbers(shape.get("size", ""))]
    else:
        size = [float(shape.get("radius", "")), 0.5 * float(shape.get("length", ""))]
    place = _words((at_x + x, at_y, at_z + z))
    return (
        f'\n      <geom type="{shape.tag}" size="{_words(size)}" pos="{place}" rgba="{_words(colour)}" mass="0"'
        ' contype="0" conaffinity="0"/>'
    )


def _numbers(words: str) -> list[float]:
    return [float(word) for word in words.split()]


def _words(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))
