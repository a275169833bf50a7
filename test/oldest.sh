#!/usr/bin/env bash
# The unit tests with ROS Noetic's Python and the libraries of Ubuntu 20.04, on a machine that has a Python 3.8 beside its own:
#
#     bash test/oldest.sh [OPTIONS OF PYTEST]      all of them
#     bash test/oldest.sh --suite RESULT.xml       as a part of all tests (CMakeLists.txt): of each test the first case
#
# The Python is the first python3.8 that runs, of PATH and of pyenv. ROS itself is this machine's. The libraries come from
# PyPI, once, into build/.ws/oldest. Without this Python or these libraries, the suite reports a skipped test with the reason.
set -euo pipefail
here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P) repo=${here%/*} old=${here%/*}/build/.ws/oldest result=
libraries='numpy==1.17.4 matplotlib==3.1.2 tornado==5.1.1 PyYAML==5.3.1 pytest==4.6.9 hypothesis==4.36.2 flake8==3.7.9 pyflakes==2.1.1
  squaternion==2023.9.2 netifaces==0.10.9 mypy==0.761'
if [ "${1:-}" = --suite ]; then
  result=$2
  # Left out: tests of programs in other processes, flake8, long drives and stories, the largest inputs, a browser, and long
  # tests whose lines of the package also run in other tests. Without --suite all tests run.
  set -- --first-cases "--junit-xml=$result" \
    --ignore="$here"/unit/test_{terminal,recipes,rollout,story_search,stops,turning,motor_response,network,node,term,doctor,submission,completion,launch,env_robot}.py \
    --ignore="$here"/unit/test_{students,simulator,simulated_robot}.py \
    -k 'not (flake8 or zip_file or largest_page or claims_gigabytes or another_goal_for_the_class
      or shows_each_moment or imports_only_go_down or private_parts
      or each_figure_has_a_name or the_page_the_pictures or movements_by_hand or noise_fit_a_page or is_read_late
      or follows_or_as_one or follows_its_quantity or by_the_axis_that_it_follows or of_another_name
      or whichever_message or statistics_are_switched or recorded_by_relative_names or a_wild_command
      or in_the_folder_of_a_stranger or goes_through_a_link or rosrun_cannot_start or reads_the_clock)'
fi

leave_out() {
  [ -n "$result" ] || { echo "tb3_labs: $1" >&2; exit 2; }
  mkdir -p "${result%/*}"    # this may be the first test that ends
  cat >"$result" <<XML
<testsuite tests="1" errors="0" failures="0"><testcase classname="oldest" name="oldest"><skipped message="test/oldest.sh was left out: $1"/></testcase></testsuite>
XML
  exit 0
}

is_oldest() { "$1" -Ic 'import sys; sys.exit(sys.version_info[:2] != (3, 8))' 2>/dev/null; }    # pyenv's shim may lead nowhere

python=
for candidate in $(type -aP python3.8) "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.8*/bin/python3.8; do
  if [ -z "$python" ] && is_oldest "$candidate"; then python=$candidate; fi
done
[ -n "$python" ] || leave_out 'there is no Python 3.8, on PATH or of pyenv'
if is_oldest /usr/bin/python3; then leave_out "this system's own Python is 3.8"; fi
rospack find tb3_labs >/dev/null 2>&1 || source "$repo/scripts/setup.sh"
if [ "$(cat "$old/complete" 2>/dev/null)" != "$python $libraries" ]; then
  mkdir -p "${old%/*}"
  "$python" -Im venv --clear "$old"
  "$old/bin/python" -Im pip install -q $libraries >"$old/pip.log" 2>&1 ||
    leave_out "its libraries cannot be had from PyPI ($old/pip.log has the reason)"
  # Behind the old libraries the system's modules: ROS. Of the compiled ones only tf2_py's names are used.
  /usr/bin/python3 -c 'import rospy; print(rospy.__path__[0].rpartition("/")[0])' >"$old/lib/python3.8/site-packages/system.pth"
  cat >"$old/lib/python3.8/site-packages/tf2_py.py" <<'END'
"""In place of the compiled module of the system's Python: names, which the modules of tf2_ros want when they are imported."""
class BufferCore: pass
class TransformException(Exception): pass
ConnectivityException = LookupException = ExtrapolationException = InvalidArgumentException = TimeoutException = TransformException
END
  echo "$python $libraries" >"$old/complete"
fi
PATH=$old/bin:$PATH exec "$old/bin/python" -m pytest -p no:cacheprovider -q "$@" "$here/unit"
