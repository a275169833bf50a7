#!/usr/bin/env bash
# Sets up tb3_labs and the shell that wants to use it; demo.sh and test.sh begin with it.
#
#     source scripts/setup.sh     (bash) set up what is missing, then put ROS and this package on this shell's paths
#     ./scripts/setup.sh          only set up
#     TB3_LABS_TESTS=1            in front of either: also what the tests need
#
# Works on Debian 12 and 11, and on Ubuntu 20.04 with ROS Noetic. It installs the system packages that are missing (root or
# sudo), and makes everything else in the folder build/.ws of the repository: a Python environment with squaternion, a catkin
# workspace whose src/tb3_labs links to the repository's files, logs. Deleting build undoes it. When nothing is missing it
# takes well under a second; a change of Python code needs no build.
#
# The shell starts from a clean slate: PYTHONPATH and other workspaces' paths are dropped, because a conda, a pyenv or
# a ROS 2 in them breaks ROS 1's Python. To combine tb3_labs with packages of your own, clone it into your own catkin
# workspace instead.
#
# Network: everything listens on the loopback only. For a real robot set ROS_IP to this computer's address first, if the
# master runs here; or ROS_MASTER_URI=http://ROBOT:11311, if it runs there: ROS_IP is then found by itself.

# --- the shell's side ---------------------------------------------------------------------------------------------
_tb3_labs_shell() {
  local -; set +euo pipefail    # the caller's options come back at the end of the function; catkin's files need these
  local here repo ws
  here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P) || return 1
  repo=${here%/*} ws=${here%/*}/build/.ws
  bash "$here/setup.sh" || return 1

  unset PYTHONPATH PYTHONHOME CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION
  # shellcheck disable=SC1091
  source "$ws/devel/setup.bash" || { echo "tb3_labs: $ws/devel/setup.bash failed" >&2; return 1; }
  PATH=:$PATH: PATH=${PATH//:"$ws/venv/bin":/:} PATH=${PATH#:} PATH=$ws/venv/bin:${PATH%:}

  export ROS_HOME=${ROS_HOME:-$ws/ros}
  export ROS_LOG_DIR=${ROS_LOG_DIR:-$ROS_HOME/log}
  # No __pycache__ in the repository. (PYTHONPYCACHEPREFIX would also hide the byte code of the system's modules.)
  unset PYTHONPYCACHEPREFIX
  export PYTHONDONTWRITEBYTECODE=1 HYPOTHESIS_STORAGE_DIRECTORY=$ws/hypothesis
  export PYTHONNOUSERSITE=1    # what pip once put into ~/.local may be too new or too old for ROS

  case ${ROS_MASTER_URI:-} in
    '' | http://localhost | http://localhost[:/]* | http://127.*)
      # ROS_HOSTNAME may be left by an earlier `source`, and would go before ROS_IP
      if [ -n "${ROS_IP:-}" ] && [ "${ROS_HOSTNAME:-}" = localhost ]; then unset ROS_HOSTNAME; fi
      [ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ] || export ROS_HOSTNAME=localhost
      if [ "${ROS_HOSTNAME:-}" = localhost ]; then export ROS_ETC_DIR=$ws/etc; fi ;;    # catkin's hook has set another
    *)
      if [ "${ROS_HOSTNAME:-}" = localhost ]; then unset ROS_HOSTNAME; fi    # left by an earlier `source`
      if [ "${ROS_ETC_DIR:-}" = "$ws/etc" ]; then unset ROS_ETC_DIR; fi
      if [ -z "${ROS_IP:-}${ROS_HOSTNAME:-}" ]; then
        ROS_IP=$("$ws/venv/bin/python3" - "$ROS_MASTER_URI" 2>/dev/null <<'PYTHON'
import socket, sys, urllib.parse
uri = urllib.parse.urlparse(sys.argv[1])
probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
probe.connect((uri.hostname, uri.port or 11311))    # sends nothing; picks the interface that leads there
print(probe.getsockname()[0])
PYTHON
        ) || { unset ROS_IP; echo "tb3_labs: no way to ROS_MASTER_URI=$ROS_MASTER_URI" >&2; return 1; }
        export ROS_IP
      fi ;;
  esac
}

if [ -z "${BASH_VERSION:-}" ]; then
  echo 'tb3_labs: scripts/setup.sh needs bash; start one first' >&2
  return 1
elif [ "${BASH_SOURCE[0]}" != "$0" ]; then
  # One status for the caller, and no function of ours left in its shell.
  if _tb3_labs_shell; then unset -f _tb3_labs_shell; return 0; else unset -f _tb3_labs_shell; return 1; fi
fi

# --- the set-up itself, a process of its own ----------------------------------------------------------------------
set -Eeuo pipefail
export LC_ALL=C.UTF-8
say() { echo "tb3_labs: $*"; }
fail() { echo "tb3_labs: $*" >&2; exit 1; }
fail_log() { tail -n 15 "$log" | sed 's/^/  | /' >&2; fail "$* (all of it: $log)"; }

trap 'fail "the set-up failed in line $LINENO of scripts/setup.sh"' ERR    # never without a word

here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
# Two names, since rosrun leaves out a package's `build` and roslaunch hidden folders: a clone inside another workspace
# keeps working there.
repo=${here%/*} ws=${here%/*}/build/.ws log=${here%/*}/build/.ws/setup.log
noetic=/opt/ros/noetic
system=$(. /etc/os-release 2>/dev/null && echo "${ID:-}:${VERSION_ID:-}") || system=unknown
requirements=(squaternion)    # from PyPI: the system has no package of them

# Nothing of the caller's Python, compiler or other workspaces may leak into the build.
unset PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONPYCACHEPREFIX VIRTUAL_ENV LD_LIBRARY_PATH CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS
unset MAKEFLAGS CMAKE_GENERATOR CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION
export PATH=/usr/sbin:/usr/bin:/sbin:/bin PYTHONDONTWRITEBYTECODE=1 PYTHONNOUSERSITE=1

if [ -r $noetic/setup.bash ]; then
  run_packages=(make g++ python3-venv python3-numpy python3-matplotlib python3-setuptools)
  for p in ros-core actionlib diagnostic-updater dynamic-reconfigure move-base-msgs robot-state-publisher rostest std-srvs tf tf2-geometry-msgs tf2-msgs tf2-ros; do run_packages+=("ros-noetic-$p"); done
  test_packages=(python3-pytest python3-hypothesis python3-mypy catkin-lint xvfb xdotool)
  dynparam=$noetic/lib/dynamic_reconfigure/dynparam
else
  run_packages=(make g++ python3-venv python3-numpy python3-matplotlib python3-setuptools catkin rosbash ros-core
    ros-message-generation libgeometry-msgs-dev ros-std-msgs ros-geometry-msgs ros-robot-state-publisher
    python3-rospy python3-rosbag python3-rosnode python3-rostest python3-actionlib python3-tf2-ros python3-tf python3-tf2-geometry-msgs python3-std-srvs python3-diagnostic-updater python3-dynamic-reconfigure
    libdynamic-reconfigure-config-init-mutex-dev)    # dynparam wants its package.xml
  for p in actionlib diagnostic geometry move-base nav rosgraph sensor std tf2 visualization; do run_packages+=("python3-$p-msgs"); done
  test_packages=(python3-pytest python3-hypothesis python3-mypy librostest-dev catkin-lint xvfb xdotool)
  dynparam=/usr/lib/dynamic_reconfigure/dynparam
fi
run_packages+=(python3-paramiko)    # roslaunch's way to the robot; it only recommends it
run_packages+=(bubblewrap)    # mark.py keeps the programs of submissions in boxes
case $system in    # the mouse
  debian:12) run_packages+=(python3-pynput) ;;
  *) run_packages+=(python3-xlib python3-six) requirements+=(pynput) ;;
esac

# missing: packages to install now.  tests: whether everything the tests need is there, and so tests are built too.
look_at_packages() {
  local installed p wanted=("${run_packages[@]}")
  installed=$(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' "${run_packages[@]}" "${test_packages[@]}" 2>/dev/null |
    sed -n 's/^[ih]i  *//p') || true
  installed=" ${installed//$'\n'/ } " missing=() tests=1
  for p in "${test_packages[@]}"; do [[ $installed == *" $p "* ]] || tests=0; done
  [ -z "${TB3_LABS_TESTS:-}" ] || wanted+=("${test_packages[@]}")
  for p in "${wanted[@]}"; do [[ $installed == *" $p "* ]] || missing+=("$p"); done
}

venv_stamp() { echo "$ws $(readlink -f /usr/bin/python3) ${requirements[*]}"; }

# All that a build depends on. Python code is not among it: the devel space refers to the sources.
build_stamp() {
  cd "$repo"
  {
    echo "$ws $(readlink -f /usr/bin/python3) tests=$tests"
    cat CMakeLists.txt package.xml setup.py scripts/setup.sh msg/*.msg srv/*.srv
    ls
    { find scripts launch test/marking test/ros test/unit -maxdepth 1 \( -name '*.py' -o -name '*.launch' -o -name '*.test' \) 2>/dev/null || true; } | sort
  } | sha256sum
}

holds() { [ -e "$1" ] && [ "$(<"$1")" = "$2" ]; }    # file, its content
venv_ready() { [ -x "$ws/venv/bin/python3" ] && holds "$ws/venv.stamp" "$(venv_stamp)"; }
build_ready() { [ -e "$ws/devel/setup.bash" ] && holds "$ws/build.stamp" "$(build_stamp)"; }

free_mb() { df -Pm "$1" | awk 'NR == 2 { print $4 }'; }

as_root() { if [ "$EUID" = 0 ]; then "$@"; else sudo "$@"; fi; }

apt() {
  as_root env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 ${http_proxy:+"http_proxy=$http_proxy"} \
    apt-get -o DPkg::Lock::Timeout=300 -o Acquire::Retries=2 -o Acquire::http::Timeout=20 "$@" 8>&-
}

install_packages() {
  local name line need free
  if [ ! -r $noetic/setup.bash ]; then
    case $system in
      debian:12 | debian:11) ;;
      ubuntu:20.04) fail 'ROS Noetic is missing; install it first: http://wiki.ros.org/noetic/Installation/Ubuntu (ros-noetic-ros-base is enough)' ;;
      *) name=$(. /etc/os-release 2>/dev/null && echo "${PRETTY_NAME:-}") || name=
        fail "${name:-this system} is not supported: it takes Debian 12 or 11, or Ubuntu 20.04 with ROS Noetic" ;;
    esac
  fi
  line="apt-get install --no-install-recommends ${missing[*]}"
  if [ "$EUID" != 0 ]; then
    command -v sudo >/dev/null || fail "rights are missing (no sudo here): have root run once: $line"
    sudo -n true 2>/dev/null || { [ -t 0 ] && say 'system packages are missing, installing them needs your password' && sudo -v; } ||
      fail "rights are missing (sudo refused): have an administrator run once: $line"
  fi

  as_root dpkg --configure -a >>"$log" 2>&1 8>&- || true    # after an interrupted installation
  [ "$(free_mb /var/lib/apt)" -ge 100 ] || fail "space is missing: 100 MB are needed in /var/lib/apt"
  say 'reading the package lists ...'
  apt update -q >"$ws/apt.log" 2>&1 || true    # a dead list that we do not need is no reason to stop
  cat "$ws/apt.log" >>"$log"
  # What apt would do, without doing it: it prints "Need to get 1,234 kB" and "After this operation, 760 MB".
  { apt install --assume-no --no-install-recommends "${missing[@]}" || true; } >"$ws/apt.plan" 2>&1
  cat "$ws/apt.plan" >>"$log"
  if grep -q '^E: ' "$ws/apt.plan"; then
    if grep -Eq '^(Err|W: Failed to fetch|E: Failed to fetch)' "$ws/apt.log"; then
      fail "the network is missing: $(sed -n 's/^[WE]: Failed to fetch \([^ ]*\).*/\1/p' "$ws/apt.log" | sed -n 1p) cannot be reached"
    fi
    fail_log "the system packages cannot be installed: $(grep -m1 '^E: ' "$ws/apt.plan")"
  fi
  need=$(sed -En 's/^Need to get ([^/]*\/)?([0-9.,]+ [kMG]?B) of.*/\2/p; s/^After this operation, ([0-9.,]+ [kMG]?B) of additional.*/\1/p' "$ws/apt.plan" |
    awk '{ gsub(",", "", $1); sum += $1 * ($2 == "GB" ? 1000 : $2 == "MB" ? 1 : 0.001) } END { print int(sum) + 1 }')
  free=$(free_mb /usr)
  [ "$free" -gt $((need + 50)) ] || fail "space is missing: the system packages need $((need + 50)) MB in /usr, $free MB are free"
  line="$need MB, once"
  [ "$need" -lt 100 ] || line+='; about a minute'
  say "installing system packages ($line) ..."
  if ! apt install -y -q --no-install-recommends -o Dpkg::Use-Pty=0 "${missing[@]}" >"$ws/apt.log" 2>&1; then
    cat "$ws/apt.log" >>"$log"
    grep -q '^E: Failed to fetch' "$ws/apt.log" && fail "the network is missing: the system packages could not be fetched (all of it: $log)"
    fail_log 'the system packages could not be installed'
  fi
  cat "$ws/apt.log" >>"$log"
}

# --system-site-packages: ROS's Python modules are the system's. --no-deps: pynput would compile evdev, of use without X
# only; what else they need is among the system packages.
make_venv() {
  say 'making the Python environment ...'
  rm -rf "$ws/venv" "$ws/venv.stamp"
  /usr/bin/python3 -m venv --system-site-packages "$ws/venv" >>"$log" 2>&1 || fail_log 'the Python environment could not be made'
  # Whatever the user's pip settings say: into this environment, and nothing kept elsewhere.
  if ! PIP_USER=0 PIP_REQUIRE_VIRTUALENV=0 PIP_TARGET='' PIP_PREFIX='' "$ws/venv/bin/python3" -m pip install --quiet --no-cache-dir --no-input \
      --disable-pip-version-check --retries 2 --timeout 20 --no-deps "${requirements[@]}" >"$ws/pip.log" 2>&1 8>&-; then
    cat "$ws/pip.log" >>"$log"
    rm -rf "$ws/venv"
    grep -Eq 'NewConnectionError|Retrying|No matching distribution|Could not fetch' "$ws/pip.log" &&
      fail "the network is missing: ${requirements[*]} could not be fetched from PyPI (all of it: $log)"
    fail_log "${requirements[*]} could not be installed from PyPI"
  fi
  ln -sfn "$dynparam" "$ws/venv/bin/dynparam"
  venv_stamp >"$ws/venv.stamp"
}

build() {
  local stamp
  stamp=$(build_stamp)
  say 'building the workspace ...'
  # No stamp: an interrupted build, or another place or Python, to whose files a rebuild would cling.
  if [ ! -e "$ws/build.stamp" ] || ! holds "$ws/build.place" "$(venv_stamp)"; then rm -rf "$ws/build" "$ws/devel"; fi
  rm -rf "$ws/build.stamp" "$ws/devel/lib/tb3_labs"    # relays of nodes that are gone would stay otherwise
  venv_stamp >"$ws/build.place"
  # The package's folder holds a link to each entry of the repository. One link to the whole would be a loop through
  # build, in which rosrun finds each node twice.
  rm -rf "$ws/src/tb3_labs"
  mkdir -p "$ws/src/tb3_labs"
  find "$repo" -mindepth 1 -maxdepth 1 ! -name '.*' ! -name build -exec ln -s -t "$ws/src/tb3_labs" {} +
  # The master alone, without rosout: that C++ node keeps a port open to the network whatever ROS_HOSTNAME says. Nodes
  # publish /rosout all the same.
  mkdir -p "$ws/etc"
  ln -sfn /etc/ros/rosdep "$ws/etc/rosdep"
  cat >"$ws/etc/roscore.xml" <<'XML'
<launch>
  <group ns="/">
    <param name="rosversion" command="rosversion roslaunch"/>
    <param name="rosdistro" command="rosversion -d"/>
  </group>
</launch>
XML
  touch "$ws/CATKIN_IGNORE"    # a clone inside another workspace: catkin shall not look in here
  if ! (
    if [ -r $noetic/setup.bash ]; then set +u; source $noetic/setup.bash; fi
    catkin_make --directory "$ws" --force-cmake -DPYTHON_EXECUTABLE="$ws/venv/bin/python3" -DCATKIN_ENABLE_TESTING="$tests"
  ) >"$ws/build.log" 2>&1 8>&-; then
    cat "$ws/build.log" >>"$log"
    grep -E -A6 'CMake Error|[Ee]rror:' "$ws/build.log" | sed -n '1,20s/^/  | /p' >&2
    fail "the build failed (all of it: $log)"
  fi
  # On their way out rospy and roslaunch 1.15.9 call what Python 3.9 no longer has; every end would be a traceback, and of
  # a node exit status 1.
  if [ "$system" = debian:11 ]; then
    echo 'import threading; threading.Thread.isAlive = threading.Thread.is_alive' >"$ws/devel/lib/python3/dist-packages/sitecustomize.py"
  fi
  echo "$stamp" >"$ws/build.stamp"
}

# CMake, make and the relays' first lines take no such path.
[[ $repo != *[[:space:]\'\"\$\&\;\(\)\#:]* ]] || fail "the path of the repository must have no spaces or special characters: $repo"
command -v dpkg-query >/dev/null || fail 'this system is not supported: it takes Debian 12 or 11, or Ubuntu 20.04 with ROS Noetic'

look_at_packages
if [ ${#missing[@]} = 0 ] && venv_ready && build_ready; then exit 0; fi

mkdir -p "$ws" 2>/dev/null && [ -w "$ws" ] || fail "rights are missing: $ws cannot be written"
foreign=$(find "$ws" -maxdepth 2 -type d ! -writable -print -quit)
[ -z "$foreign" ] || fail "rights are missing: $foreign belongs to another user (remove it: sudo rm -rf $ws)"
exec 8>"$ws/lock"
flock -n 8 || { say 'waiting for another set-up to end ...'; flock 8; }
trap 'echo "tb3_labs: interrupted; the next start carries on" >&2; exit 130' INT TERM HUP

: >"$log"
[ "$(free_mb "$ws")" -ge 100 ] || fail "space is missing: 100 MB are needed in $ws, $(free_mb "$ws") MB are free"
look_at_packages
if [ ${#missing[@]} != 0 ]; then install_packages; look_at_packages; fi
[ ${#missing[@]} = 0 ] || fail_log "system packages are still missing: ${missing[*]}"
venv_ready || make_venv
build_ready || build
