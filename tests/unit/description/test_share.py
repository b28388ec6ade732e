# SPDX-License-Identifier: Apache-2.0
"""Where data files are found."""

from __future__ import annotations

import pytest

from fivebar_description.files import share_file


def test_data_files_of_a_package_are_found() -> None:
    assert share_file("fivebar_description", "package.xml").is_file()
    assert share_file("fivebar_description", "config", "dextar.yaml").read_text(encoding="utf-8").startswith("#")


def test_a_package_that_is_not_installed_is_named() -> None:
    with pytest.raises(ModuleNotFoundError, match="fivebar_nowhere is not installed"):
        share_file("fivebar_nowhere", "package.xml")
