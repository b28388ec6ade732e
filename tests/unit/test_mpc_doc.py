"""docs/mpc.md says what the settings of the predictive law are, and what its horizon can still do on the locus."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_bringup.studies.single.mpc_study import authority, motion
from fivebar_control.laws.lqr import LqrSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.mpc_problem import SCALE, weights_of

DOCS = Path(__file__).parents[2] / "docs"
LIMITS = {"torque_limit", "torque_rate_limit"}


@pytest.mark.parametrize(("page", "settings"), [("mpc.md", MpcSettings()), ("lqr.md", LqrSettings())])
def test_the_settings_are_those_of_the_law(page: str, settings: MpcSettings | LqrSettings) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([\d.e-]+) .*\|.*\|$", text, re.MULTILINE)
    told = {name: float(value) for name, value in rows}
    told.pop("unified", None)  # the row of the study to compare with
    assert told == {name: value for name, value in settings._asdict().items() if name not in LIMITS}


def test_the_weight_on_the_torque_itself_is_that_of_the_cost() -> None:
    text = (DOCS / "mpc.md").read_text(encoding="utf-8")
    (found,) = re.findall(r"\$r_0 = (\d+) \\cdot 10\^\{(-\d+)\}\\,r_s\$, ([\d.]+) % of \$r\$ by default", text)
    share = float(found[0]) * 10.0 ** float(found[1])
    settings = MpcSettings()
    # a row of the program without a plan, a change or a prediction is what remains
    alone = weights_of(2, 0.01, settings.speed_time, 1.0, settings.step_weight, settings.weight)
    assert np.allclose(alone.torques - alone.steps, SCALE * share * settings.step_weight * np.eye(4), rtol=1e-9)
    assert 100.0 * share * settings.step_weight / settings.weight == pytest.approx(float(found[2]), rel=0.2)


def test_the_least_authority_on_the_locus_is_that_of_the_table() -> None:
    scenario = motion(MIDDLE, 0.5)
    for samples, wanted in ((2, 0.00048), (25, 0.27)):
        found = authority(scenario, samples)
        least = 1e3 * min(value for value, kappa in zip(found.least, found.kappa, strict=True) if kappa < 0.056)
        assert least == pytest.approx(wanted, rel=0.02)
