#!/usr/bin/env bash
# Measures drives and turns, both laws side by side, against the robot's true pose (motions.py), and what the nodes cost
# beside bare rospy subscribers (nodes.py). What a whole class costs: classroom.py; what the panel does: panel.py.
#
#     bash test/benchmark/run.sh [NUMBER OF DRIVES]
set -euo pipefail
here=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
unset CMAKE_PREFIX_PATH    # no other workspace's tb3_labs
source "$here/../../scripts/setup.sh" || exit 1
python3 "$here/motions.py" "$@"
echo
python3 "$here/nodes.py"
