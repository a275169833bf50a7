#!/usr/bin/env bash
# Measures drives and turns, both laws side by side, against the robot's true pose (scripts/benchmark.py), and what the
# nodes cost beside bare rospy subscribers (scripts/benchmark_nodes.py).
#
#     ./scripts/benchmark.sh [NUMBER OF DRIVES]
set -euo pipefail
source "$(dirname -- "${BASH_SOURCE[0]}")/setup.sh" || exit 1
here=$(dirname -- "${BASH_SOURCE[0]}")
python3 "$here/benchmark.py" "$@"
echo
python3 "$here/benchmark_nodes.py"
