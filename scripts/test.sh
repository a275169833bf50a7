#!/usr/bin/env bash
# Sets up what is missing, builds, runs all tests, and names the slowest ones. The last line is `N passed, N failed` (and
# `, N skipped`). The exit status is 0 only if nothing failed and every test file ran tests.
#
#     ./scripts/test.sh              everything
#     ./scripts/test.sh unit         the core only (pytest)
#     ./scripts/test.sh ros          the nodes only (rostest)
#     ./scripts/test.sh NAME ...     only the tests whose name contains NAME, such as a file in test/ros
#     -j N, in front                 tests at a time (7)
#
# pytest with options of its own: source scripts/setup.sh, then python3 -m pytest -p no:cacheprovider test/unit ...
set -euo pipefail
PATH=/usr/bin:/bin:$PATH    # ROS's own tools, not those of a conda or pyenv

# Tests must see neither a robot on the network nor this user's settings.
unset ROS_MASTER_URI ROS_IP ROS_NAMESPACE ROSCONSOLE_FORMAT ROSCONSOLE_CONFIG_FILE TURTLEBOT3_MODEL PYTEST_ADDOPTS PYTHONOPTIMIZE
unset ROS_HOME ROS_LOG_DIR CMAKE_PREFIX_PATH    # nor other workspaces
export ROS_HOSTNAME=localhost

repo=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
case ${1:-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;;
esac

jobs=7
if [ "${1:-}" = -j ]; then jobs=${2:?'-j: a number is missing'}; shift 2; fi
[[ $jobs =~ ^[1-9][0-9]*$ ]] || { echo "tb3_labs: -j: not a number: $jobs" >&2; exit 2; }

ws=$repo/build/.ws
if [ -e "$ws" ] && [ ! -w "$ws" ]; then
  echo "tb3_labs: the tests write into $ws, which is another user's: run them in a copy of your own" >&2; exit 1
fi
export TB3_LABS_TESTS=1
source "$repo/scripts/setup.sh" || exit 1
results=$ws/build/test_results log=$ws/test.log
export TMPDIR=$ws/tmp
rm -rf "$TMPDIR" "$results"    # a former run's results would count again
rm -f "$ws/build/Testing/Temporary/CTestCostData.txt"    # ctest's order is that of CMakeLists.txt, not of the last run
mkdir -p "$TMPDIR" "$results"
# The tests start some hundred nodes. Byte code saves 0.1 s in each, and is deleted when the tests end.
unset PYTHONDONTWRITEBYTECODE
# catkin runs tests with the environment of the build's configuration. With the system's roscore.xml, each master would start
# rosout, and two programs that print versions.
sed -i "s|^export ROS_ETC_DIR=.*|export ROS_ETC_DIR='$ROS_ETC_DIR'|" "$ws/build/catkin_generated/setup_cached.sh"
# roslaunch and rostest import distutils, and then all of setuptools if it is installed: a quarter of a second in each
# of a hundred starts. From Python 3.12 on there is no other distutils.
if SETUPTOOLS_USE_DISTUTILS=stdlib python3 -I -W ignore -c 'import distutils' 2>/dev/null; then export SETUPTOOLS_USE_DISTUTILS=stdlib; fi
# numpy, which rospy imports, starts a thread of OpenBLAS for each core: a tenth of a second in each of some hundred processes.
export OPENBLAS_NUM_THREADS=1
# A Python that ends looks for cycles in all of rospy's objects: 0.1 to 0.2 s in each of some hundred processes.
site=$ws/devel/lib/python3/dist-packages/sitecustomize.py freeze='import atexit, gc; atexit.register(gc.freeze)'
grep -qsxF "$freeze" "$site" || echo "$freeze" >>"$site"
trap 'sed -i "/gc.freeze/d" "$site"; find "$repo"/{src,test,doc} -name __pycache__ -prune -exec rm -rf {} +' EXIT

# ctest's names of catkin's tests are _ctest_tb3_labs_<kind>_<name>, and kind is pytest or rostest.
names() { (cd "$ws/build" && ctest -N ${1:+-R "$1"}) | sed -n 's/^ *Test *#[0-9]*: _ctest_tb3_labs_/  /p'; }
pattern=
for name; do
  case $name in
    -*) echo "tb3_labs: unknown option $name; ./scripts/test.sh --help" >&2; exit 2 ;;
    unit) name=_pytest_unit ;;
    ros) name=_rostest_ ;;
    *) name=$(sed 's/[][\\.*^$+?(){}|]/\\&/g' <<<"${name##*/}") ;;
  esac
  pattern+=${pattern:+|}$name
done

if [ -n "$pattern" ] && [ -z "$(names "$pattern")" ]; then
  { echo "tb3_labs: no test's name contains: $*; there are:"; names; } >&2; exit 2
fi

# ctest runs the same tests as `catkin_make run_tests`, but shows progress, and ends with an error after a failure.
started=$SECONDS ctest_status=0
(cd "$ws/build" && ctest --no-tests=error --output-on-failure -j "$jobs" ${pattern:+-R "$pattern"}) 2>&1 </dev/null |
  tee "$log" | sed -un 's/^ *\([0-9]*\/[0-9]*\) Test *#[0-9]*: _ctest_tb3_labs_/\1 /p; /^No tests were found/p; /]\[\(FAILURE\|ERROR\)\]/,+14p; /^E  /p' || ctest_status=$?
echo "$((SECONDS - started)) s; full output: $log"

python3 "$ws/src/tb3_labs/test/count_results.py" "$results" "$ctest_status" "$log"
