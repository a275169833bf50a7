#!/bin/sh
# Checks a launch before roslaunch starts anything. Each launch file runs it while it is read:
#     check.sh FILE.launch CHECK_LAUNCH
# FILE.launch is that launch file, CHECK_LAUNCH the path of scripts/check_launch.py. That looks at the whole launch, and
# takes half a second. So only the file that roslaunch was started with runs it, none that is included, and no rostest.
[ -z "${TB3_LABS_LAUNCH_IS_CHECKED:-}" ] || exit 0    # by scripts/demo.sh
case " $(tr '\0' ' ' <"/proc/$PPID/cmdline")" in
  *roslaunch*[\ /]"$1"\ *) exec "$2" ;;
esac
