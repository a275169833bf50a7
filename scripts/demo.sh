#!/usr/bin/env bash
# The demonstration: sets up what is missing, then runs launch/demo.launch and its judge, demo.py. Ends with 0 only if the
# demonstration succeeded.
#
#     ./scripts/demo.sh                 both drives, then the table
#     ./scripts/demo.sh stay:=true      leaves everything running afterwards; Ctrl+C ends it
#     ./scripts/demo.sh rviz:=false     without RViz, which opens if it is installed and there is a screen
#     ./scripts/demo.sh ARG:=VALUE ...  any argument of demo.launch (roslaunch --ros-args tb3_labs demo.launch lists them)
set -euo pipefail
case ${1:-} in -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;; esac
for word; do
  [[ $word =~ ^[a-z_]+:=. ]] || { echo "tb3_labs: $word is not an argument: NAME:=VALUE, such as stay:=true (--help shows more)" >&2; exit 2; }
done
PATH=/usr/bin:/bin:$PATH    # ROS's own tools, not those of a conda or pyenv
unset CMAKE_PREFIX_PATH    # nor another workspace's tb3_labs
scripts=$(dirname -- "${BASH_SOURCE[0]}")    # a background job must not compute it: with Ctrl+C it would run without it
# The set-up's errors are printed at its end. After Ctrl+C only the lines of setup.sh itself are printed, not the
# tracebacks of its programs.
said=$(mktemp)
trap 'rm -f "$said"' EXIT
trap 'grep "^tb3_labs: " "$said" >&2; exit 130' INT TERM HUP
ready=yes
source "$scripts/setup.sh" 2>"$said" || ready=
cat "$said" >&2
[ -n "$ready" ] || exit 1
trap 'exit 130' INT TERM HUP

# The demonstration starts its own master: at another one there may be a real robot, which would drive, too. The lock finds
# a second demonstration that starts at the same moment.
address=${ROS_MASTER_URI#*://} address=${address%%/*}
exec 9>>"/tmp/tb3_labs_demo.$UID.${address##*:}.lock"
if ! flock -n 9 || timeout 2 bash -c ": <>/dev/tcp/${address%:*}/${address##*:}" 2>/dev/null; then
  echo "tb3_labs: a ROS master is running at $ROS_MASTER_URI already; end it first, or set ROS_MASTER_URI=http://localhost:11312" >&2
  exit 1
fi

# Can a window be opened? DISPLAY may be left over from another user or session.
has_screen() {
  [ -n "${DISPLAY:-}" ] && timeout 5 python3 2>/dev/null - <<'PYTHON'
import ctypes
open_display = ctypes.CDLL('libX11.so.6').XOpenDisplay
open_display.restype = ctypes.c_void_p
raise SystemExit(not open_display(None))
PYTHON
}
if [[ " $*" != *' rviz:='* ]] && rospack find rviz >/dev/null 2>&1 && has_screen; then set -- rviz:=true "$@"; fi

mkdir -p "$ROS_LOG_DIR"
run=$(mktemp -d "$ROS_LOG_DIR/demo.XXXXXX")
trap 'rm -rf "$said" "$run"' EXIT
mkfifo "$run/output"

patience=12
if [[ " $* " == *' record:='[Tt]rue* ]]; then patience=100; fi

# The nodes write into a pipe. Without PYTHONUNBUFFERED their lines would come late, and in another order.
export PYTHONUNBUFFERED=1 ROSCONSOLE_FORMAT=${ROSCONSOLE_FORMAT:-'[${severity}] ${message}'}

# Job control: roslaunch has a process group of its own, and gets each signal once, from the keyboard or by this script. A
# signal that comes while the programs are started waits until the number of each is known, so that none is left behind.
interrupted=
trap 'interrupted=yes' INT TERM HUP
set -m
# The filter leaves out roslaunch's own lines, also those after a refused argument, and lines that RViz, Debian's rospack
# and a rosdep without data print at every start.
sed -uE '/RLException: Invalid <param> tag: Cannot load command/,/^(.\[[0-9]+m)?The traceback for/d
  /^(.\[[0-9]+m)?(\[rviz-[0-9]+\] process has finished cleanly|log file: .*\/rviz-[0-9]+\*\.log|QStandardPaths: |the rosdep view is empty: |\[rospack\] Error: no such package media_export|\[librospack\]: error while executing command)/d
  /^(.\[1m)?(\.\.\. logging to|started roslaunch server|auto-starting new master|process\[|ROS_MASTER_URI=|setting \/run_id|started core service|shutting down processing monitor|\.\.\. shutting down|done.?|\[[^] ]+\] killing on exit)/d' \
  <"$run/output" 9>&- &
filter=$!
roslaunch --disable-title --skip-log-check --no-summary tb3_labs demo.launch "$@" </dev/null >"$run/output" 2>&1 9>&- &
launch=$!
python3 "$scripts/demo.py" __name:=demo </dev/null >"$run/output" 2>&1 9>&- &
judge=$!

# roslaunch waits 15 s for a node that does not hear SIGINT, such as one that is just starting. A recorder needs time to end.
interrupt() {
  trap '' INT TERM HUP
  exec 2>/dev/null    # bash names each process that it ends
  cat <"$run/output" >/dev/null 9>&- &    # from here on only tracebacks of nodes that are just starting
  local sink=$! nodes _
  kill -KILL "$filter" "$judge" 2>/dev/null || true
  kill -TERM -- "-$launch" 2>/dev/null || true
  for ((_ = 0; _ < patience; _++)); do kill -0 "$launch" 2>/dev/null || break; sleep 0.1; done
  for _ in 1 2 3; do
    nodes=$(cat "/proc/$launch/task/$launch/children" 2>/dev/null) || break
    kill -KILL $nodes 2>/dev/null || true
    sleep 0.1
  done
  kill -KILL -- "-$launch" 2>/dev/null || true
  kill "$sink" 2>/dev/null || true
  exit 130
}
trap interrupt INT TERM HUP
[ -z "$interrupted" ] || interrupt

# If roslaunch or the judge ends, the other one is ended. bash prints no line about this.
status=0
{
  wait -n "$launch" "$judge" || status=$?
  if kill -0 "$judge"; then status=1; kill -KILL "$judge"; else kill -TERM "$launch"; fi
  wait "$launch" "$judge" "$filter" || true
} 2>/dev/null
exit "$status"
