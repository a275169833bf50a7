# shellcheck shell=bash disable=SC2154,SC2034,SC2086    # variables of scripts/setup.sh, which sources this file
# The system's packages: which are needed, which are missing, and their installation by apt.

# The supported systems.
supported='Debian 13, 12 and 11, Ubuntu 22.04, or Ubuntu 20.04 with ROS Noetic'

# find_ros FOLDER: sets ros to the folder of a Noetic beside the system's packages, or to ''.
find_ros() { ros=; if [ -r "$1/noetic/setup.bash" ]; then ros=$1/noetic; fi; }

# run_packages and test_packages are the names on this system. lab_report.py asks for late_packages, a quarter of all
# packages, when it is started. requirements are the packages from PyPI.
name_packages() {
  local p
  late_packages=(python3-matplotlib)
  requirements=(squaternion)    # the system does not have it
  if [ -n "$ros" ]; then
    run_packages=(make g++ python3-venv python3-numpy python3-setuptools)
    for p in ros-core actionlib diagnostic-updater dynamic-reconfigure move-base-msgs robot-state-publisher rostest std-srvs tf tf2-geometry-msgs tf2-msgs tf2-ros; do run_packages+=("ros-noetic-$p"); done
    test_packages=(python3-pytest python3-hypothesis python3-flake8 python3-mypy catkin-lint xvfb xdotool)
  else
    run_packages=(make g++ python3-venv python3-numpy python3-setuptools catkin rosbash ros-core ros-environment
      ros-message-generation libgeometry-msgs-dev ros-std-msgs ros-geometry-msgs ros-robot-state-publisher
      python3-rospy python3-rosbag python3-rosnode python3-rostest python3-actionlib python3-tf2-ros python3-tf python3-tf2-geometry-msgs python3-std-srvs python3-diagnostic-updater python3-dynamic-reconfigure
      libdynamic-reconfigure-config-init-mutex-dev)    # rosrun dynamic_reconfigure wants its package.xml
    for p in actionlib diagnostic geometry move-base nav rosgraph sensor std tf2 visualization; do run_packages+=("python3-$p-msgs"); done
    test_packages=(python3-pytest python3-hypothesis python3-flake8 python3-mypy librostest-dev catkin-lint xvfb xdotool)
  fi
  test_packages+=("${late_packages[@]}")
  run_packages+=(python3-paramiko)    # roslaunch reaches the robot by it, but only recommends it
  run_packages+=(bubblewrap)    # mark.py keeps the programs of submissions in sandboxes
  run_packages+=(python3-tornado)    # the web server of the panel
  case $system in debian:*) test_packages+=(chromium chromium-driver python3-selenium) ;; esac    # elsewhere the panel is tested without a browser
  case $system in    # the mouse
    debian:12 | debian:13) run_packages+=(python3-pynput) ;;
    *) run_packages+=(python3-xlib python3-six) requirements+=(pynput) ;;
  esac
}

# The lines of requirements.txt for the packages that come from PyPI here.
pinned() { local p; for p in "${requirements[@]}"; do grep "^$p==" "$repo/scripts/setup/requirements.txt"; done; }
pip_exactly=(--no-deps --only-binary :all: --require-hashes)

# Sets `missing` to the packages to install now. Sets `tests` to 1 if all packages of the tests are there: then the tests are
# also built.
look_at_packages() {
  local installed p wanted=("${run_packages[@]}")
  installed=$(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' "${run_packages[@]}" "${test_packages[@]}" 2>/dev/null |
    sed -n 's/^[ih]i  *//p') || true
  installed=" ${installed//$'\n'/ } " missing=() tests=1
  for p in "${test_packages[@]}"; do [[ $installed == *" $p "* ]] || tests=0; done
  [ -z "${TB3_LABS_TESTS:-}" ] || wanted+=("${test_packages[@]}")
  for p in "${wanted[@]}"; do [[ $installed == *" $p "* ]] || missing+=("$p"); done
}

as_root() { if [ "$EUID" = 0 ]; then "$@"; else sudo "$@"; fi; }

apt() {
  as_root env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 ${http_proxy:+"http_proxy=$http_proxy"} \
    apt-get -o DPkg::Lock::Timeout=300 -o Acquire::Retries=2 -o Acquire::http::Timeout=20 "$@" 8>&-
}

# Ends the set-up with one line if Noetic is missing, or if this system is not supported.
refuse_system() {
  local name container='docker build -t tb3_labs -f .devcontainer/Dockerfile .'
  name=$(. /etc/os-release 2>/dev/null && echo "${PRETTY_NAME:-}") || name=
  name=${name:-this system}
  case $system in
    debian:13 | debian:12 | debian:11 | ubuntu:22.04) ;;
    ubuntu:20.04) fail 'ROS Noetic is missing; install it first: http://wiki.ros.org/noetic/Installation/Ubuntu (ros-noetic-ros-base is enough)' ;;
    *) fail "$name is not supported: it takes $supported; elsewhere use the container: $container" ;;
  esac
}

install_packages() {
  local line
  [ -n "$ros" ] || refuse_system
  line="apt-get update; apt-get install --no-install-recommends ${missing[*]}"
  if [ "$EUID" != 0 ]; then
    # dpkg refuses the user's PATH, which root would keep without the dash of `su -`
    command -v sudo >/dev/null || fail "rights are missing (no sudo here): type this, and root's password, then start again: su - -c '$line'"
    sudo -n true 2>/dev/null || { [ -t 0 ] && say 'system packages are missing, installing them needs your password' && sudo -v; } ||
      fail "rights are missing (sudo refused): have an administrator run once: $line"
  fi

  as_root dpkg --configure -a >>"$log" 2>&1 8>&- || true    # after an interrupted installation
  say 'reading the package lists ...'
  apt update -q >"$ws/apt.log" 2>&1 || true    # a list that cannot be fetched may not be needed
  cat "$ws/apt.log" >>"$log"
  # Without a network, an apt with old lists would ask for each package, for a minute and without success.
  grep -Eq '^(Hit|Get):' "$ws/apt.log" ||
    fail "the network is missing: $(sed -n 's/^[WE]: Failed to fetch \([^ ]*\).*/\1/p' "$ws/apt.log" | sed -n 1p) cannot be reached"
  say 'installing system packages (once; about a minute) ...'
  if ! apt install -y -q --no-install-recommends -o Dpkg::Use-Pty=0 "${missing[@]}" >>"$log" 2>&1; then
    fail_log 'the system packages could not be installed'
  fi
}
