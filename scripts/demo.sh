#!/usr/bin/env bash
# Sets up what is missing, then runs launch/demo.launch. The exit status is 0 only if the demonstration succeeded.
#
#     ./scripts/demo.sh                 both drives, then the table
#     ./scripts/demo.sh stay:=true      leaves everything running afterwards; Ctrl+C ends it
#     ./scripts/demo.sh rviz:=true      with RViz, if it is installed
#     ./scripts/demo.sh ARG:=VALUE ...  any argument of demo.launch (roslaunch --ros-args tb3_labs demo.launch lists them)
set -euo pipefail
case ${1:-} in -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;; esac
for word; do
  [[ $word =~ ^[a-z_]+:=. ]] || { echo "tb3_labs: $word is not an argument: NAME:=VALUE, such as stay:=true (--help shows more)" >&2; exit 2; }
done
PATH=/usr/bin:/bin:$PATH    # ROS's own tools, not those of a conda or pyenv
unset CMAKE_PREFIX_PATH    # nor another workspace's tb3_labs

# All programs inherit TB3_LABS_DEMO, the path of this folder. finish() finds each program by this variable.
run=$(mktemp -d)
patience=1.2    # [s]; roslaunch would wait 15 s for a node that is just starting. A recorder needs time to end.
if [[ " $* " == *' record:='[Tt]rue* ]]; then patience=10; fi
finish() {
  local job left
  trap '' INT TERM HUP
  exec 2>/dev/null    # bash names each process that it ends
  for job in $(jobs -p); do    # roslaunch leads the group; the filter ends immediately, and no traceback is shown
    kill -TERM -- "-$job" || true
    timeout "$patience" tail -s 0.1 --pid="$job" -f /dev/null || true
    kill -KILL -- "-$job" || true
  done
  while left=$(grep -lsxzF "TB3_LABS_DEMO=$run" /proc/[0-9]*/environ | cut -d/ -f3); [ -n "$left" ]; do
    kill -KILL $left || true
    sleep 0.1
  done
  rm -rf "$run"
}
trap finish EXIT

# The set-up's errors are printed at its end. After Ctrl+C only the lines of setup.sh itself are printed, not the
# tracebacks of its programs.
trap 'grep -s "^tb3_labs: " "$run/said" >&2 || true; exit 130' INT TERM HUP
ready=yes
source "${BASH_SOURCE[0]%/*}/setup.sh" 2>"$run/said" || ready=
cat "$run/said" >&2
[ -n "$ready" ] || exit 1
trap 'exit 130' INT TERM HUP

# The demonstration starts its own master, because it would also drive a real robot of another master. The lock finds a second
# demonstration that starts at the same moment.
address=${ROS_MASTER_URI#*://} address=${address%%/*}
exec 9>>"/tmp/tb3_labs_demo.$UID.${address##*:}.lock"
if ! flock -n 9 || timeout 2 bash -c ": <>/dev/tcp/${address%:*}/${address##*:}" 2>/dev/null; then
  echo "tb3_labs: a ROS master is running at $ROS_MASTER_URI already; end it first (Ctrl+C in its terminal; after a Ctrl+Z type fg there before), or type: export ROS_MASTER_URI=http://localhost:11312" >&2
  exit 1
fi

# The nodes write into a pipe. Without PYTHONUNBUFFERED their lines would come late, and in another order.
export PYTHONUNBUFFERED=1 ROSCONSOLE_FORMAT=${ROSCONSOLE_FORMAT:-'[${severity}] ${message}'}

# By job control the group of roslaunch gets no Ctrl+C of the keyboard, and finish() ends the group. The filter
# drops lines of roslaunch (also after a refusal), RViz, Debian's rospack and a rosdep without data.
set -m
TB3_LABS_DEMO=$run roslaunch --disable-title --skip-log-check --no-summary tb3_labs demo.launch "$@" </dev/null 2>&1 9>&- |
  sed -uE '/RLException: Invalid <param> tag: Cannot load command/,/^(.\[[0-9]+m)?The traceback for/d
    /REQUIRED process \[demo-/,/^={80}/d
    /^(.\[[0-9]+m)?(INFO: cannot create a symlink|\[rviz-[0-9]+\] process has finished cleanly|log file: .*\/rviz-[0-9]+\*\.log|QStandardPaths: |the rosdep view is empty: |\[rospack\] Error: no such package media_export|\[librospack\]: error while executing command)/d
    /^(.\[1m)?(\.\.\. logging to|started roslaunch server|auto-starting new master|process\[|ROS_MASTER_URI=|setting \/run_id|started core service|shutting down processing monitor|\.\.\. shutting down|done.?|\[[^] ]+\] killing on exit)/d' 9>&- &
wait
[ -e "$run/good" ]
