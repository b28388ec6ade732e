# SPDX-License-Identifier: Apache-2.0
"""Finds out which packages of ROS are installed, for launch files."""

from __future__ import annotations

from ament_index_python.packages import PackageNotFoundError, get_package_prefix


def is_installed(package: str) -> bool:
    """Return whether a package is installed."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return False
    return True


def refuse_missing(asked: str, *packages: str) -> None:
    """Refuse what needs packages that are not installed.

    Raises:
        RuntimeError: one of them is not.
    """
    missing = [package for package in packages if not is_installed(package)]
    if missing:
        raise RuntimeError(f"{asked}: needs {', '.join(missing)}: expected installed packages of ROS")
