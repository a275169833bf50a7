# Sets what a terminal needs beside catkin's paths. This file is an environment hook of the devel space that scripts/setup.sh
# builds. catkin sources the hook for that space, and for each workspace that was built on top of that space. So
# `source ~/catkin_ws/devel/setup.bash` alone makes the same terminal as `source scripts/setup.sh`.

_tb3_labs_terminal() {
  local ws=${CATKIN_ENV_HOOK_WORKSPACE%/devel} home=~/.ros
  PATH=:$PATH: PATH=${PATH//:"$ws/venv/bin":/:} PATH=${PATH#:} PATH=$ws/venv/bin:${PATH%:}
  # `PYTHONPATH=$PYTHONPATH:...` in a .bashrc may leave an empty entry, which Python takes for the current folder.
  PYTHONPATH=$(tr -s : <<<":${PYTHONPATH:-}:") PYTHONPATH=${PYTHONPATH#:} PYTHONPATH=${PYTHONPATH%:}

  # In this terminal the catkin_make of Debian 13 takes the Python of the active virtual environment, and CMake 4 refuses
  # catkin's top level without the second variable.
  export VIRTUAL_ENV=$ws/venv CMAKE_POLICY_VERSION_MINIMUM=3.5

  if [ -O "$ws" ] && [ -w "$ws" ]; then home=$ws/ros; fi    # a room's installation belongs to another user
  export ROS_HOME=${ROS_HOME:-$home}
  export ROS_LOG_DIR=${ROS_LOG_DIR:-$ROS_HOME/log}
  # Python writes no __pycache__ into the repository. PYTHONPYCACHEPREFIX would hide the byte code of the system's modules.
  unset PYTHONPYCACHEPREFIX PYTHONOPTIMIZE    # --help prints docstrings
  export PYTHONDONTWRITEBYTECODE=1 HYPOTHESIS_STORAGE_DIRECTORY=$ROS_HOME/hypothesis
  export PYTHONNOUSERSITE=1    # packages in ~/.local may be too new or too old for ROS

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
        ROS_IP=$("$ws/venv/bin/python3" -I - "$ROS_MASTER_URI" <<'PYTHON'
import socket, sys, urllib.parse
probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
try:
    uri = urllib.parse.urlparse(sys.argv[1])
    probe.connect((uri.hostname, uri.port or 11311))    # sends nothing; picks the interface that leads there
    print(probe.getsockname()[0])
except (TypeError, ValueError):
    problem = 'is not an address such as http://192.168.0.5:11311'
except socket.gaierror:
    problem = 'has a name that this computer cannot resolve'
except OSError as error:
    problem = f'cannot be reached ({error.strerror})'
else:
    sys.exit()
sys.exit(f'tb3_labs: ROS_MASTER_URI={sys.argv[1]} {problem}. Do: export ROS_MASTER_URI=http://ADDRESS:11311, then source setup.sh again')
PYTHON
        ) || { unset ROS_IP; return 1; }
        export ROS_IP
      fi ;;
  esac
}

# A person's bash gets roscd, and completion by the Tab key. Noetic's own hook sources rosbash. Debian has rosbash in a folder
# of bash-completion, which does not source it. The second folder is Debian 11's.
if [[ $- == *i* ]]; then
  for _tb3_labs_rosbash in /usr/share/bash-completion/completions/rosbash /etc/bash_completion.d/rosbash; do
    # shellcheck disable=SC1090
    if ! declare -F roscd >/dev/null && [ -r "$_tb3_labs_rosbash" ]; then source "$_tb3_labs_rosbash"; fi
  done
  unset _tb3_labs_rosbash
fi

_tb3_labs_terminal || true    # the caller may have `set -e`
unset -f _tb3_labs_terminal
