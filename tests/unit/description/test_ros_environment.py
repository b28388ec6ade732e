# SPDX-License-Identifier: Apache-2.0
"""The environment of ROS: each wrong variable has one line, and logs need no home directory."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from fivebar_description.errors import InputError
from fivebar_description.ros_environment import (
    check_middleware,
    domain_of_environment,
    provide_log_folder,
)


@pytest.mark.parametrize(("text", "domain"), [(None, 0), ("", 0), ("0", 0), ("7", 7), ("007", 7), ("101", 101)])
def test_a_domain_is_read(text: str | None, domain: int) -> None:
    assert domain_of_environment({} if text is None else {"ROS_DOMAIN_ID": text}) == domain


@pytest.mark.parametrize("text", ["banana", "300", "102", "-1", "1.5", " 7", "\u0663", "\u00b2", "1e1", "9" * 5000])
def test_what_is_no_domain_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^ROS_DOMAIN_ID: .*: expected a number from 0 to 101$"):
        domain_of_environment({"ROS_DOMAIN_ID": text})


def test_a_middleware_counts_as_installed_where_ros_finds_its_library(tmp_path: Path) -> None:
    for name in ("", "rmw_fastrtps_cpp"):
        check_middleware({"RMW_IMPLEMENTATION": name, "LD_LIBRARY_PATH": f"{sys.prefix}/lib"})
    missing = {"RMW_IMPLEMENTATION": "rmw_elsewhere_cpp"}
    with pytest.raises(InputError, match=r"RMW_IMPLEMENTATION: 'rmw_elsewhere_cpp': .*`unset RMW_IMPLEMENTATION`"):
        check_middleware(missing)
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "librmw_elsewhere_cpp.so").touch()
    check_middleware({**missing, "LD_LIBRARY_PATH": f"/nowhere:{tmp_path}/lib"})
    check_middleware({**missing, "AMENT_PREFIX_PATH": str(tmp_path)})


def test_logs_go_where_ros_puts_them(tmp_path: Path) -> None:
    for variables in ({"ROS_LOG_DIR": "a"}, {"ROS_HOME": "b"}, {"HOME": "c"}):
        environment = {name: str(tmp_path / folder) for name, folder in variables.items()}
        before = dict(environment)
        provide_log_folder(environment)
        assert environment == before
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b", "c"}


@pytest.mark.parametrize("home", [{}, {"HOME": ""}, {"HOME": "/dev/null/home"}])
def test_without_a_home_logs_have_a_folder_of_their_own(home: dict[str, str]) -> None:
    provide_log_folder(home)
    folder = Path(home["ROS_LOG_DIR"])
    assert folder.is_dir() and folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("variable", ["ROS_LOG_DIR", "ROS_HOME"])
def test_a_folder_for_logs_that_cannot_be_written_to_is_refused(variable: str) -> None:
    with pytest.raises(InputError, match=f"^{variable}: '/dev/null/logs': cannot be written to: Not a directory"):
        provide_log_folder({variable: "/dev/null/logs", "HOME": "/tmp"})
