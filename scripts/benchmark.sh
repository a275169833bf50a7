#!/usr/bin/env bash
# Measures drives and turns, both laws side by side, against the robot's true pose; see scripts/benchmark.py.
#
#     ./scripts/benchmark.sh [NUMBER OF DRIVES]
set -euo pipefail
source "$(dirname -- "${BASH_SOURCE[0]}")/setup.sh" || exit 1
exec python3 "$(dirname -- "${BASH_SOURCE[0]}")/benchmark.py" "$@"
