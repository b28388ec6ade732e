# SPDX-License-Identifier: Apache-2.0
"""Runs a launch file with the service behind `ros2 launch`, and exits as that does.

python launch_service.py FILE NAME:=VALUE ...
"""

from __future__ import annotations

import sys

from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource


def main(path: str, *arguments: str) -> int:
    """Return the exit status of a launch, once all of it has ended."""
    service = LaunchService(argv=arguments)
    values = [tuple(argument.split(":=", 1)) for argument in arguments]
    included = IncludeLaunchDescription(PythonLaunchDescriptionSource(path), launch_arguments=values)
    service.include_launch_description(LaunchDescription([included]))
    return int(service.run())


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
