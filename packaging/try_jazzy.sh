#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tries packaging/jazzy.sh in a fresh Debian 12, with apt's numpy, scipy, matplotlib and numba, and with the ROS wheels
# in place of /opt/ros; it ends with a crossing, and with a look at apt's packages. For root, a quarter of an hour:
#   packaging/try_jazzy.sh [FOLDER]    # the new root of the file system, outside of the repository; it is left there
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
root=${1:-$(mktemp -d)/root}
refuse() { echo "try-jazzy: $*" >&2; exit 2; }
[ "$(id -u)" = 0 ] || refuse "only root can make a root of a file system"
command -v debootstrap >/dev/null || refuse "debootstrap not found: apt install debootstrap"
case $root/ in "$source"/*) refuse "$root is inside of the repository" ;; esac

# what rosdep install brings, for the keys of package.xml; Pinocchio and rclpy come from ROS
keys=$(sed -n 's|.*<exec_depend[^>]*>\(python3-[^<]*\)<.*|\1|p' "$source"/src/*/package.xml | sort -u | paste -sd,)
colcon=$(printf ",python3-colcon-%s" core bash metadata recursive-crawl parallel-executor ros test-result)
tools="ca-certificates,python3-venv,python3-pip,colcon$colcon"
certificates=${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}
if [ ! -e "$root/tried" ]; then
    debootstrap --variant=minbase --include="$tools,$keys" \
        bookworm "$root" http://deb.debian.org/debian
    cp "$certificates" "$root/etc/ssl/certs/ca-certificates.crt"
    touch "$root/tried"
fi
mount --bind /proc "$root/proc" && mount --bind /dev "$root/dev"
trap 'umount "$root/proc" "$root/dev"' EXIT
inside() { chroot "$root" env -i HOME=/home/fivebar LANG=C.UTF-8 PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin "$@"; }
inside id fivebar >/dev/null 2>&1 || inside useradd --create-home fivebar
cp /etc/resolv.conf /etc/hosts "$root/etc/"

# the ROS wheels and Pinocchio, as /opt/ros/jazzy has them; what apt has is not among them
sed -nE '/^(ros-|pin==|cmeel|eigenpy|coal|libcoal|libpinocchio)/,/[^\\]$/p' "$source/packaging/lowest-3.11.lock" > "$root/tmp/ros.lock"
if [ ! -d "$root/opt/ros" ]; then
    inside python3 -m venv /opt/ros
    inside /opt/ros/bin/pip install --quiet --no-cache-dir --no-deps --require-hashes -r /tmp/ros.lock
    # colcon takes apt's
    inside /opt/ros/bin/pip uninstall --quiet --yes setuptools
fi
cat > "$root/opt/ros/setup.bash" <<'SETUP'
wheels=/opt/ros/lib/python3.11/site-packages
export PYTHONPATH=$wheels:$wheels/cmeel.prefix/lib/python3.11/site-packages ROS_DISTRO=jazzy
LD_LIBRARY_PATH=/opt/ros/lib$(printf ':%s' "$wheels"/ros_*.libs)
export LD_LIBRARY_PATH
SETUP

rm -rf "$root/home/fivebar/workspace" "$root/home/fivebar/simulated" "$root/home/fivebar/ran"
mkdir "$root/home/fivebar/workspace"
git -C "$source" ls-files -z --cached --others --exclude-standard -- src packaging requirements.in docs/index.md \
    | tar -C "$source" --null --files-from=- -c | tar -C "$root/home/fivebar/workspace" -x
chroot "$root" chown -R fivebar:fivebar /home/fivebar
before=$(inside dpkg --verify; inside sha256sum /var/lib/dpkg/status)

as_user() { inside setpriv --reuid=fivebar --regid=fivebar --clear-groups bash -euo pipefail -c "cd ~/workspace; $1"; }
as_user "source /opt/ros/setup.bash; packaging/jazzy.sh"
as_user "source /opt/ros/setup.bash; set +u; source install/setup.bash; set -u; cd; fivebar simulate middle --out simulated --no-page; fivebar run middle --out ran"
as_user "source /opt/ros/setup.bash; set +u; source install/setup.bash; set -u; cd; head -1 \$(dirname \$(command -v fivebar))/../../../lib/fivebar_bringup/fivebar"

# apt's packages are as they were, and work
[ "$before" = "$(inside dpkg --verify; inside sha256sum /var/lib/dpkg/status)" ] || refuse "apt's packages were changed"
inside python3 -c '
import matplotlib.pyplot, numba, numpy, scipy.linalg
assert scipy.linalg.det(numpy.eye(3)) == 1.0
assert numba.njit(lambda x: x + 1)(1) == 2
print("apt:", numpy.__version__, scipy.__version__, matplotlib.__version__, numba.__version__, numpy.__file__)'
echo "try-jazzy: crossed; apt's packages are unchanged and work; the root is $root"
