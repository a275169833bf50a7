#!/usr/bin/env bash
# Sets up tb3_labs, and the shell that sources this file. demo.sh and test.sh begin with this set-up.
#
#     source scripts/setup.sh     (bash) set up what is missing, then put ROS and this package on this shell's paths
#     ./scripts/setup.sh          only set up; the last line tells what to type in each terminal
#     TB3_LABS_TESTS=1            in front of each: set up the tests, too
#
# Works on Debian 13, 12 and 11, on Ubuntu 22.04 (tried once), and on Ubuntu 20.04 with ROS Noetic. On any other system, use
# the container: docker build -t tb3_labs -f .devcontainer/Dockerfile .
#
# The set-up installs the missing system packages (as root or by sudo). Everything else is made in the repository's folder
# build/.ws: a Python environment with squaternion, a catkin workspace whose src/tb3_labs links to the repository's files, and
# logs. To undo the set-up, delete build. When nothing is missing, the set-up takes well under a second. A change of Python
# code needs no build.
#
# A catkin workspace that was sourced earlier stays, and a workspace that is sourced later is added. Both go before tb3_labs.
# A conda, a pyenv or a ROS 2 on PYTHONPATH and CMAKE_PREFIX_PATH is dropped, because it breaks ROS 1's Python.
# One installation serves all accounts of a machine. All accounts but the owner keep logs and caches in ~/.ros.
#
# Network: all nodes listen on the loopback only. For a real robot whose master runs here, first set ROS_IP to this
# computer's address. If the master runs on the robot, set ROS_MASTER_URI=http://ROBOT:11311: then ROS_IP is found.

# This check stands first: dash, which is sh here, has no arrays and could not read the rest.
if [ -z "${BASH_VERSION:-}" ]; then
  echo 'tb3_labs: scripts/setup.sh needs bash; start one first' >&2
  return 1
fi

# --- the shell's side, with scripts/setup/terminal.bash -------------------------------------------------------------------
_tb3_labs_shell() {
  local -; set +euo pipefail    # catkin's files need these options; the end of the function restores the caller's options
  local here repo ws prefix prefixes=() kept=() hook=etc/catkin/profile.d/1.ros_package_path.sh
  here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P) || return 1
  repo=${here%/*} ws=${here%/*}/build/.ws
  TB3_LABS_SOURCED=1 bash "$here/setup.sh" || return 1

  IFS=: read -ra prefixes <<<"${CMAKE_PREFIX_PATH:-}"
  unset PYTHONPATH PYTHONHOME CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION CATKIN_SETUP_UTIL_ARGS
  # shellcheck disable=SC1091
  source "$ws/devel/setup.bash" || { echo "tb3_labs: $ws/devel/setup.bash failed" >&2; return 1; }

  for prefix in "${prefixes[@]}"; do if _tb3_labs_keeps "$prefix"; then kept=("$prefix" "${kept[@]}"); fi; done
  if [ ${#kept[@]} != 0 ]; then
    # shellcheck disable=SC1091
    for prefix in "${kept[@]}"; do source "$prefix/local_setup.bash"; done    # the last one comes first, as catkin has it
    # a local_setup.bash runs the hooks of its own folder alone; Noetic's hook that makes ROS_PACKAGE_PATH is in /opt/ros/noetic
    IFS=: read -ra prefixes <<<"$CMAKE_PREFIX_PATH"
    # shellcheck disable=SC1090
    for prefix in "${prefixes[@]}"; do if [ -r "$prefix/$hook" ]; then source "$prefix/$hook"; fi; done
    if [ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ]; then
      # shellcheck source=scripts/setup/terminal.bash
      CATKIN_ENV_HOOK_WORKSPACE=$ws/devel; source "$repo/scripts/setup/terminal.bash"; unset CATKIN_ENV_HOOK_WORKSPACE
    fi
  fi
  # Without this, a workspace that was built without tb3_labs, and is sourced later, would remove this one.
  export CATKIN_SETUP_UTIL_ARGS=--extend
  [ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ] || return 1    # scripts/setup/terminal.bash has said why
  if [[ $- == *i* ]] && [ -t 1 ]; then echo "tb3_labs: this terminal is ready"; fi
}

# Does a folder of CMAKE_PREFIX_PATH stay? A workspace of catkin stays. A ROS, another tb3_labs that its setup.sh set up,
# a ROS 2, a conda and a missing folder are dropped.
_tb3_labs_keeps() {
  local first python sources
  [ -f "$1/.catkin" ] && [ -f "$1/_setup_util.py" ] && [ -f "$1/local_setup.bash" ] && [ ! -e "$1/conda-meta" ] || return 1
  [[ $1 != */build/.ws/devel && $1 != /opt/ros/* ]] || return 1
  IFS=';' read -r sources _ <"$1/.catkin"    # a devel space has its source folder here, an install space has nothing
  read -r first <"$1/_setup_util.py"; python=${first#'#!'}    # catkin_make writes its Python here, as into each node's relay
  if [ ! -x "${python%% *}" ]; then
    echo "tb3_labs: $1 is left out: it was built with $python, which is gone. Once: cd ${1%/*} && rm -rf build devel && catkin_make" >&2
    return 1
  fi
  if [ -n "$sources" ] && [ "$python" != "$ws/venv/bin/python3" ] && [[ $python != *' '* ]] &&
      ! "$python" -c 'import sys; del sys.path[0]; import importlib.util as u; sys.exit(None in map(u.find_spec, ("rospy", "squaternion")))' 2>/dev/null; then
    echo "tb3_labs: ${1%/*} was built with $python, which lacks rospy or squaternion. Once: cd ${1%/*} && rm -rf build devel && catkin_make" >&2
  fi
}

if [ "${BASH_SOURCE[0]}" != "$0" ]; then
  # The caller gets one status, and no function of this file stays in its shell.
  if _tb3_labs_shell; then unset -f _tb3_labs_shell _tb3_labs_keeps; return 0; else unset -f _tb3_labs_shell _tb3_labs_keeps; return 1; fi
fi

# --- the set-up itself, a process of its own ----------------------------------------------------------------------
set -Eeuo pipefail
export LC_ALL=C.UTF-8
say() { echo "tb3_labs: $*"; }
fail() { echo "tb3_labs: $*" >&2; exit 1; }
fail_log() { tail -n 15 "$log" | sed 's/^/  | /' >&2; fail "$* (all of it: $log)"; }

trap 'fail "the set-up failed in line $LINENO of scripts/setup.sh"' ERR

here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
# rosrun leaves out a package's `build`, and roslaunch leaves out hidden folders. So a clone works inside another workspace.
repo=${here%/*} ws=${here%/*}/build/.ws log=${here%/*}/build/.ws/setup.log
system=$(. /etc/os-release 2>/dev/null && echo "${ID:-}:${VERSION_ID:-}") || system=unknown

# Nothing of the caller's Python, compiler or other workspaces may leak into the build.
unset PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONPYCACHEPREFIX VIRTUAL_ENV LD_LIBRARY_PATH CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS
unset MAKEFLAGS CMAKE_GENERATOR CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION CATKIN_SETUP_UTIL_ARGS
export PATH=/usr/sbin:/usr/bin:/sbin:/bin PYTHONDONTWRITEBYTECODE=1 PYTHONNOUSERSITE=1

# shellcheck source=scripts/setup/packages.sh
source "$repo/scripts/setup/packages.sh"

venv_stamp() { echo "$ws $(readlink -f /usr/bin/python3) $(pinned)"; }

# Prints a sum of all files on which a build depends. Python code is left out, because the devel space refers to it.
build_stamp() {
  cd "$repo"
  {
    echo "$ws $(readlink -f /usr/bin/python3) tests=$tests"
    cat CMakeLists.txt package.xml setup.py scripts/setup.sh scripts/setup/* msg/*.msg srv/*.srv
    ls
    { find scripts launch launch/checks test/ros test/unit -maxdepth 1 \( -name '*.py' -o -name '*.launch' -o -name '*.test' \) 2>/dev/null || true; } | sort
  } | sha256sum
}

holds() { [ -e "$1" ] && [ "$(<"$1")" = "$2" ]; }    # file, its content
venv_ready() { [ -x "$ws/venv/bin/python3" ] && holds "$ws/venv.stamp" "$(venv_stamp)"; }
build_ready() { [ -e "$ws/devel/setup.bash" ] && holds "$ws/build.stamp" "$(build_stamp)"; }

# --system-site-packages: ROS's Python modules are the system's.
make_venv() {
  local without_pip=(--without-pip)
  say 'making the Python environment ...'
  rm -rf "$ws/venv" "$ws/venv.stamp" "$ws/build.stamp"    # the build also writes into the environment
  # fill_venv would use the system's pip instead of the environment's
  if /usr/bin/python3 -Ic 'import pip' 2>/dev/null; then without_pip=(); fi
  /usr/bin/python3 -Im venv --system-site-packages ${without_pip[@]+"${without_pip[@]}"} "$ws/venv" >>"$log" 2>&1 || fail_log 'the Python environment could not be made'
}

# Runs the environment's pip without the user's settings.
pip_in_venv() {
  PIP_USER=0 PIP_REQUIRE_VIRTUALENV=0 PIP_TARGET='' PIP_PREFIX='' "$ws/venv/bin/python3" -Im pip "$1" --quiet --no-cache-dir --no-input \
    --disable-pip-version-check "${@:2}" "${pip_exactly[@]}" -r <(pinned) >"$ws/pip.log" 2>&1
}

# Installs pip, and the packages from PyPI by version and checksum, while the workspace is built without them.
# --no-deps: pynput would compile evdev, which is needed only without X; the system packages have all other dependencies.
# Only wheels are installed, because they run no program.
# The files stay in the user's cache: the next copy of this repository is set up without a network.
fill_venv() {
  local kept=${XDG_CACHE_HOME:-${HOME:-$ws}/.cache}/tb3_labs
  if [ ! -e "$ws/venv/bin/pip" ]; then
    # ensurepip of Python 3.9 imports modules of the current folder
    (cd "$ws" && "$ws/venv/bin/python3" -Im ensurepip --upgrade --default-pip) >>"$log" 2>&1 || fail_log 'the Python environment could not be given a pip'
  fi
  { mkdir -p "$kept" && [ -w "$kept" ]; } 2>/dev/null || fail "rights are missing: $kept cannot be written"
  if ! pip_in_venv install --no-index --find-links "$kept" &&
      ! { pip_in_venv download --retries 2 --timeout 20 --dest "$kept" &&
        pip_in_venv install --no-index --find-links "$kept"; }; then
    cat "$ws/pip.log" >>"$log"
    grep -q 'DO NOT MATCH THE HASHES' "$ws/pip.log" &&
      fail "a file for Python is not the one that scripts/setup/requirements.txt names, so nothing was installed (all of it: $log)"
    fail_log "the network is missing, or PyPI: ${requirements[*]} could not be installed"
  fi
  venv_stamp >"$ws/venv.stamp"
}

build() {
  local stamp name
  stamp=$(build_stamp)
  say 'building the workspace ...'
  # A build without a stamp was interrupted. A build over old files would keep those of an earlier place or Python.
  if [ ! -e "$ws/build.stamp" ] || ! holds "$ws/build.place" "$(venv_stamp)"; then rm -rf "$ws/build" "$ws/devel"; fi
  rm -rf "$ws/build.stamp" "$ws/devel/lib/tb3_labs"    # the folder may contain relays of nodes that are gone
  venv_stamp >"$ws/build.place"
  # The package's folder holds a link to each entry of the repository. One link to the whole repository
  # would be a loop through build: rosrun would find each node twice.
  rm -rf "$ws/src/tb3_labs"
  mkdir -p "$ws/src/tb3_labs"
  find "$repo" -mindepth 1 -maxdepth 1 ! -name '.*' ! -name build -exec ln -s -t "$ws/src/tb3_labs" {} +
  # roscore starts the master without rosout, because this C++ node opens a port to the network in spite of ROS_HOSTNAME.
  # Nodes publish /rosout nevertheless.
  mkdir -p "$ws/etc"
  ln -sfn /etc/ros/rosdep "$ws/etc/rosdep"
  touch "$ws/CATKIN_IGNORE"    # if this clone is inside another workspace, catkin must not look in here
  if ! (
    if [ -n "$ros" ]; then set +u; source "$ros/setup.bash"; fi
    # The file has values, because with commands each roslaunch would start Python twice.
    cat >"$ws/etc/roscore.xml" <<XML
<launch>
  <group ns="/">
    <param name="rosversion" value="$(rosversion roslaunch)"/>
    <param name="rosdistro" value="$(rosversion -d)"/>
  </group>
</launch>
XML
    # The catkin of Debian 13 reads the second name of the Python's variable. CMake 4 requires an oldest version for catkin's
    # top level.
    catkin_make --directory "$ws" --force-cmake -DPYTHON_EXECUTABLE="$ws/venv/bin/python3" -DPython_EXECUTABLE="$ws/venv/bin/python3" \
      -DCMAKE_POLICY_VERSION_MINIMUM=3.5 -DCATKIN_ENABLE_TESTING="$tests"
  ) >"$ws/build.log" 2>&1 8>&-; then
    cat "$ws/build.log" >>"$log"
    fail_log 'the build failed'
  fi
  mkdir -p "$ws/devel/etc/catkin/profile.d" "$ws/devel/lib/python3/dist-packages"
  printf '#!/bin/sh\nexec "%s" "%s" dynparam "$@"\n' "$ws/venv/bin/python3" "$repo/launch/run.py" | install /dev/stdin "$ws/venv/bin/dynparam"
  # If a workspace that was built without this one is sourced, it sets ROS_ETC_DIR to the system's folder again.
  for name in roscore roslaunch; do
    printf '#!/bin/sh\ncase $ROS_HOSTNAME:${ROS_ETC_DIR:-} in localhost:*/etc/ros) export ROS_ETC_DIR="%s" ;; esac\nexec "%s" "$@"\n' \
      "$ws/etc" "${ros:-/usr}/bin/$name" | install /dev/stdin "$ws/venv/bin/$name"
  done
  ln -sfn "$repo/scripts/setup/terminal.bash" "$ws/devel/etc/catkin/profile.d/50.tb3_labs.bash"
  # rospy and roslaunch 1.15.9 call Thread.isAlive at their end, which Python 3.9 no longer has. So every end would print a
  # traceback, and a node would exit with status 1.
  if [ "$system" = debian:11 ]; then
    echo 'import threading; threading.Thread.isAlive = threading.Thread.is_alive' >"$ws/devel/lib/python3/dist-packages/sitecustomize.py"
  fi
  echo "$stamp" >"$ws/build.stamp"
}

make_ready() {
  local foreign filling='' lack='what is built there is missing or older than the files'
  if [ -e "$ws" ] && ! [ -O "$ws" ] && ! [ -w "$ws" ]; then
    [ ${#missing[@]} = 0 ] || lack="system packages are missing: ${missing[*]}"
    fail "$(stat -c %U "$ws"), whose installation this is, must run $repo/scripts/setup.sh once: $lack"
  fi
  umask 022    # other accounts of this machine may use it
  { mkdir -p "$ws" && [ -w "$ws" ]; } 2>/dev/null || fail "rights are missing: $ws cannot be written"
  foreign=$(find "$ws" -maxdepth 2 -type d ! -writable -print -quit)
  [ -z "$foreign" ] || fail "rights are missing: $foreign belongs to another user (remove it: sudo rm -rf $ws)"
  exec 8>"$ws/lock"
  flock -n 8 || { say 'waiting for another set-up to end ...'; flock 8; }
  exec 9>&2    # apt's own output goes elsewhere
  trap 'echo "tb3_labs: interrupted; the next start carries on" >&9; exit 130' INT TERM HUP

  : >"$log"
  look_at_packages
  if [ ${#missing[@]} != 0 ]; then install_packages; name_packages; look_at_packages; fi
  [ ${#missing[@]} = 0 ] || fail_log "system packages are still missing: ${missing[*]}"
  if ! venv_ready; then
    make_venv
    set -m    # fill_venv gets its own process group, which an interruption ends
    fill_venv 8>&- </dev/null &
    filling=$!
    set +m
    trap 'kill -TERM -- "-$filling" 2>/dev/null || true; wait' EXIT
  fi
  build_ready || build
  if [ -n "$filling" ]; then wait "$filling" || exit 1; trap - EXIT; fi
}

case ${1:-} in
  '') ;;
  -h | --help) sed -n '2,/^$/s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
  *) echo "tb3_labs: unknown option $1; ./scripts/setup.sh --help" >&2; exit 2 ;;
esac

# CMake, make and the first lines of the relays do not work with such a path.
[[ $repo != *[[:space:]\'\"\$\&\;\(\)\#:]* ]] || fail "catkin takes no path with blanks or special characters; move it, such as: mv '$repo' ~/tb3_labs"
command -v dpkg-query >/dev/null || refuse_system

find_ros /opt/ros
name_packages
look_at_packages
if [ ${#missing[@]} != 0 ] || ! venv_ready || ! build_ready; then make_ready; fi
if [ -t 1 ] && [ -z "${TB3_LABS_SOURCED:-}" ]; then say "all is set up. In each terminal, type: source $repo/scripts/setup.sh"; fi
