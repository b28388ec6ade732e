#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the workspace for ROS 2 Jazzy: what apt lacks or has too old goes into the virtual environment .jazzy, which
# sees the system's packages and changes none; colcon then builds with its interpreter, so that `ros2 run`, `ros2
# launch` and `fivebar` use it. Further words go to colcon build, such as --symlink-install.
#   source /opt/ros/jazzy/setup.bash && packaging/jazzy.sh && source install/setup.bash
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
refuse() { echo "jazzy: $*" >&2; exit 2; }

python=${PYTHON:-/usr/bin/python3}
"$python" -c 'import ensurepip, venv' 2>/dev/null || refuse "$python lacks the venv module: apt install python3-venv"
"$python" -c 'import rclpy' 2>/dev/null || refuse "$python does not find rclpy: source /opt/ros/jazzy/setup.bash first"
colcon=$(command -v colcon) || refuse "colcon not found: apt install python3-colcon-common-extensions"

"$python" -m venv --system-site-packages .jazzy
touch .jazzy/COLCON_IGNORE
.jazzy/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps --only-binary :all: \
    --require-hashes -r packaging/jazzy.lock
.jazzy/bin/python packaging/check_environment.py
printf '#!/bin/sh\nexec "%s" "%s" "$@"\n' "$PWD/.jazzy/bin/python" "$colcon" > .jazzy/bin/colcon
chmod +x .jazzy/bin/colcon
.jazzy/bin/colcon build --base-paths src "$@"
[ -f install/setup.bash ] || refuse "colcon has built nothing: its extensions for ROS and bash are needed"
echo "jazzy: now source install/setup.bash, in every new shell"
