# SPDX-License-Identifier: Apache-2.0
"""The pictures of docs/laws.md show what their captions say."""

from __future__ import annotations

import numpy as np
import pytest

from law_pictures import NEAR, crossed, draw_lqr, draw_path, pushed


@pytest.mark.extra
def test_after_a_push_unified_is_in_time_and_the_path_law_on_the_path() -> None:
    unified, path = pushed("unified"), pushed("path")
    assert 1e3 * np.max(unified.beside) == pytest.approx(1.8, abs=0.1)
    assert 1e3 * np.max(path.beside) == pytest.approx(0.4, abs=0.1)
    assert 1e3 * np.min(unified.ahead) == pytest.approx(-3.9, abs=0.2)
    assert 1e3 * np.min(path.ahead) == pytest.approx(-19.5, abs=1.0)
    assert len(draw_path().axes) == 2


@pytest.mark.extra
def test_the_peak_of_the_torque_is_beside_the_locus_and_goes_with_the_criterion() -> None:
    quintic, criterion = crossed("quintic"), crossed("criterion")
    assert np.max(quintic.torque) == pytest.approx(1.8, abs=0.02)
    assert quintic.kappa[np.argmax(quintic.torque)] < NEAR
    assert np.max(criterion.torque) < 0.6
    assert len(draw_lqr().axes) == 1
