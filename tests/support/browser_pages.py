# SPDX-License-Identifier: Apache-2.0
"""What the tests in a browser share: waiting for a page, and comparing it with the pictures of the documentation."""

from __future__ import annotations

import os
import time
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

IMAGES = Path(__file__).parents[2] / "docs" / "images"

RENEW = os.environ.get("RENEW_SCREENSHOTS")
"""Whether to write the pictures of the documentation instead of comparing with them."""

COARSE = 8
"""Pictures are compared at an eighth of their size, so that fonts and edges of another machine do not matter."""


PATIENCE = 300.0
"""Longest time (s) for what takes seconds on an idle machine."""

LOOK_PERIOD_MS = 40.0


def until(page: Any, expression: str) -> None:
    """Wait until a condition holds in a page; Playwright itself would evaluate text there, which the policy forbids."""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(LOOK_PERIOD_MS)


def assert_looks_like(page: Any, selector: str, name: str, part: str = "") -> None:
    """Compare an element, or a part of it that stays the same, with a picture of the documentation; or write that."""
    data = page.locator(selector).screenshot()
    picture = IMAGES / f"{name}.png"
    if RENEW:
        # few colours, because the pictures are part of the repository
        Image.open(BytesIO(data)).convert("RGB").quantize(64).save(picture, optimize=True)
        return
    seen = Image.open(BytesIO(data)).convert("RGB")
    wanted = Image.open(picture).convert("RGB")
    assert abs(seen.width - wanted.width) <= 2
    if part:
        whole, inner = page.locator(selector).bounding_box(), page.locator(part).bounding_box()
        left, top = inner["x"] - whole["x"], inner["y"] - whole["y"]
        frame = (round(left), round(top), round(left + inner["width"]), round(top + inner["height"]))
        seen, wanted = seen.crop(frame), wanted.crop(frame)
    assert abs(seen.height - wanted.height) <= 0.1 * wanted.height
    size = (wanted.width // COARSE, wanted.height // COARSE)
    shrunk = [np.asarray(image.resize(size, Image.Resampling.BOX), dtype=np.float64) for image in (seen, wanted)]
    differs = np.max(np.abs(shrunk[0] - shrunk[1]), axis=2) > 40.0
    assert np.mean(differs) < 0.05
