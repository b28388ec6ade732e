# SPDX-License-Identifier: Apache-2.0
"""The environment that ROS starts in: domain, middleware and folder for logs, checked before ROS loads and complains.

Nothing here imports ROS, whose libraries end the process while they are loaded where the middleware is missing.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Mapping, MutableMapping
from pathlib import Path

from fivebar_description.errors import InputError

BAD_INPUT = 2

HIGHEST_DOMAIN = 101
"""Largest ROS_DOMAIN_ID whose ports are below Linux's ephemeral range."""

Environment = MutableMapping[str, str]


def check_ros_environment(environment: Environment = os.environ) -> None:
    """Check what ROS takes from the environment, and give it a folder for its logs where it would find none.

    Raises:
        InputError: a variable is wrong; the text says which, and what was expected.
    """
    domain_of_environment(environment)
    check_middleware(environment)
    provide_log_folder(environment)


def domain_of_environment(environment: Mapping[str, str] = os.environ) -> int:
    """Return ROS_DOMAIN_ID, 0 where it is unset or empty.

    Raises:
        InputError: it is no domain.
    """
    text = environment.get("ROS_DOMAIN_ID") or "0"
    if re.fullmatch("0*[0-9]{1,3}", text) is None or int(text[-3:]) > HIGHEST_DOMAIN:
        raise InputError(f"ROS_DOMAIN_ID: {text!r}: expected a number from 0 to {HIGHEST_DOMAIN}")
    return int(text)


def check_middleware(environment: Mapping[str, str] = os.environ) -> None:
    """Refuse a ROS middleware that is not installed.

    Raises:
        InputError: RMW_IMPLEMENTATION names one.
    """
    name = environment.get("RMW_IMPLEMENTATION")
    if name and not _is_installed(f"lib{name}.so", environment):
        raise InputError(
            f"RMW_IMPLEMENTATION: {name!r}: no such ROS middleware is installed: install it, or take the default with"
            " `unset RMW_IMPLEMENTATION`"
        )


def require_middleware() -> None:
    """End the process with one line and exit status 2 where its ROS middleware is not installed.

    Packages of nodes call it when they are imported: each node imports ROS next, which would end the process itself.
    """
    try:
        check_middleware()
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(BAD_INPUT)


def _is_installed(library: str, environment: Mapping[str, str]) -> bool:
    """Return whether a shared library is where ROS looks for it."""
    folders = [Path(entry) for entry in environment.get("LD_LIBRARY_PATH", "").split(os.pathsep) if entry]
    prefixes = [sys.prefix, *environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)]
    if any(
        (folder / library).is_file() for folder in [*folders, *(Path(prefix) / "lib" for prefix in prefixes if prefix)]
    ):
        return True
    try:
        ctypes.CDLL(library)
    except (OSError, ValueError):
        return False
    return True


def provide_log_folder(environment: Environment = os.environ) -> None:
    """Check the folder for the logs of ROS, or make one for as long as this process runs where the home has no place.

    Raises:
        InputError: ROS_LOG_DIR or ROS_HOME names a folder that cannot be written to.
    """
    for variable, within in (("ROS_LOG_DIR", ""), ("ROS_HOME", "log"), ("HOME", ".ros/log")):
        text = environment.get(variable)
        if not text:
            continue
        folder = Path(text).expanduser() / within
        problem = _why_unusable(folder)
        if problem is None:
            return
        if variable != "HOME":
            raise InputError(f"{variable}: {text!r}: {problem}: expected a folder for the logs of ROS")
    environment["ROS_LOG_DIR"] = log_folder = tempfile.mkdtemp(prefix="fivebar-ros-log-")
    atexit.register(_remove, log_folder, os.getpid())


def _why_unusable(folder: Path) -> str | None:
    """Return why no file can be made in a folder, which is made where it is missing; None if one can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return None
    except OSError as error:
        return f"cannot be written to: {error.strerror}"


def _remove(folder: str, owner: int) -> None:
    """Remove a folder, unless this is a fork of the process that made it."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
