#!/usr/bin/env bash
# The unit tests with ROS Noetic's Python and the libraries of Ubuntu 20.04, on a machine that has a Python 3.8 beside its own:
#
#     bash test/oldest.sh python3.8 [OPTIONS OF PYTEST]
#
# ROS itself is this machine's. The libraries come from PyPI, once, into build/.ws/oldest. They are not in the suite, since
# they want a network and another Python; that guards the syntax alone (test/unit/test_house.py).
set -euo pipefail
repo=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P) old=$repo/build/.ws/oldest
python=$(command -v "${1:-}") || { echo 'usage: bash test/oldest.sh PYTHON [OPTIONS OF PYTEST], such as python3.8' >&2; exit 2; }
"$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 8))' || { echo "tb3_labs: $python is no Python 3.8" >&2; exit 2; }
source "$repo/scripts/setup.sh"
if [ ! -e "$old/complete" ]; then
  "$python" -m venv --clear "$old"
  "$old/bin/python" -m pip install -q numpy==1.17.4 matplotlib==3.1.2 tornado==5.1.1 PyYAML==5.3.1 pytest==4.6.9 hypothesis==4.36.2 \
    squaternion==2023.9.2 netifaces==0.10.9 mypy==0.761 flake8==3.7.9
  # Behind the old libraries the system's modules: ROS. Of those that are compiled the tests use none but tf2_py, by its names.
  /usr/bin/python3 -c 'import rospy; print(rospy.__path__[0].rpartition("/")[0])' >"$old/lib/python3.8/site-packages/system.pth"
  cat >"$old/lib/python3.8/site-packages/tf2_py.py" <<'END'
"""In place of the compiled module of the system's Python: names, which the modules of tf2_ros want when they are imported."""
class BufferCore: pass
class TransformException(Exception): pass
ConnectivityException = LookupException = ExtrapolationException = InvalidArgumentException = TimeoutException = TransformException
END
  touch "$old/complete"
fi
PATH=$old/bin:$PATH exec "$old/bin/python" -m pytest -p no:cacheprovider -q "${@:2}" "$repo/test/unit"
