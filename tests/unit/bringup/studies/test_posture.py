# SPDX-License-Identifier: Apache-2.0
"""The command `fivebar posture`: what it refuses, and when it says how to get off the Type 2 locus."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("inf", "1"), "Q11: inf: expected a finite number"),
        (("nan", "1"), "Q11: nan: expected a finite number"),
        (("1.2", "-inf"), "Q21: -inf: expected a finite number"),
        (("1.2", "1.9", "--rate", "nan"), "--rate: nan: expected a finite number"),
        (("95", "85"), "Q11: 95: expected at most 12.57 rad, two turns: is it in degrees or mrad?"),
        (("1.2", "-1484"), "Q21: -1484: expected at most 12.57 rad, two turns: is it in degrees or mrad?"),
        (("1.2", "1.9", "--rate", "200"), "--rate: 200: expected at most 100 rad/s: is it in deg/s or rpm?"),
        (("--after", "run", "--robot", "motkin"), "--robot: expected without --after: the robot is that of the run"),
        (("1.2",), "Q11 Q21 and --after: expected one of them"),
        (("1.2", "1.9", "--platform", "0", "0.1"), "--platform: 0.0 0.1: expected two finite numbers with --release"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(arguments: tuple[str, ...], expected: str) -> None:
    done = CliRunner().invoke(app, ["posture", *arguments])
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", f"fivebar: {expected}\n")


@pytest.mark.parametrize(("y", "near"), [(0.0845, True), (0.12, False)])
def test_text_and_json_tell_the_way_out_only_near_the_locus(dextar: FiveBar, y: float, near: bool) -> None:
    angles = inverse_geometry(dextar, (1, -1), 0.0, y)
    asked = ["posture", f"{angles.q11:.6f}", f"{angles.q21:.6f}"]
    text = CliRunner().invoke(app, asked).stdout
    content = json.loads(CliRunner().invoke(app, [*asked, "--json"]).stdout)
    assert content["near"] == near
    assert (len(content["way_out"]) > 0) == near
    assert ("the way out:" in text) == near
    assert [line.strip() for line in text.splitlines() if line.startswith("  ")] == content["way_out"]


def test_a_release_is_planned_for_both_modes_or_refused_with_the_reason(dextar: FiveBar) -> None:
    angles = inverse_geometry(dextar, (1, -1), 0.0, 0.0845)
    asked = ["posture", f"{angles.q11:.6f}", f"{angles.q21:.6f}", "--release"]
    planned = json.loads(CliRunner().invoke(app, [*asked, "--json"]).stdout)["release"]
    assert planned["falls_to"] == [1, -1]
    (_, above), (_, below) = planned["ends_m"]
    assert below < 0.0845 < above
    assert planned["turn_rad"][0] == pytest.approx(-planned["turn_rad"][1], rel=1e-3)
    text = CliRunner().invoke(app, asked).stdout
    assert f"with {planned['torque_at_most_nm'][0]:.3f} and" in text
    # both elbows in one place: only with the platform's place
    together = ["posture", "0.855878", "2.285714", "--release"]
    refused = CliRunner().invoke(app, together)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "the platform may be anywhere on a circle about them" in refused.stderr
    placed = [*together, "--platform", "0.083", "0.103"]
    assert json.loads(CliRunner().invoke(app, [*placed, "--json"]).stdout)["release"]["falls_to"] == [1]
    assert "away from the locus" not in CliRunner().invoke(app, placed).stdout
    away = CliRunner().invoke(app, ["posture", "1.2", "1.9", "--release"])
    assert away.exit_code == 2
    assert away.stderr.startswith("fivebar: not near the Type 2 locus: the platform is ")


def test_a_release_without_a_gyroscope_says_its_way_its_side_and_its_odds(dextar: FiveBar) -> None:
    angles = inverse_geometry(dextar, (1, -1), 0.0, 0.0844926)
    asked = ["posture", f"{angles.q11:.6f}", f"{angles.q21:.6f}", "--release", "--without-gyroscope"]
    planned = json.loads(CliRunner().invoke(app, [*asked, "--json"]).stdout)["release"]
    assert planned["falls_to"] == [1, -1]
    assert 0.999 < planned["odds"] < 1.0
    assert planned["drive_m"] == 0.022
    assert 0.1 < planned["drive_seconds"] < 0.3
    text = CliRunner().invoke(app, asked).stdout
    assert "before that they drive the platform by 22 mm in 0.21 s along" in text
    assert f"; the first with a probability of {planned['odds']:.4f}" in text
    # by default a gyroscope tells
    plain = json.loads(CliRunner().invoke(app, [*asked[:-1], "--json"]).stdout)["release"]
    assert (plain["odds"], plain["drive_m"], plain["drive_seconds"]) == (None, 0.0, 0.0)
    refused = CliRunner().invoke(app, [*asked[:3], "--without-gyroscope"])
    assert (refused.exit_code, refused.stderr) == (2, "fivebar: --without-gyroscope: expected with --release\n")
