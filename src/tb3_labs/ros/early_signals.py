"""Import this module first: then Ctrl+C ends a node at once, even during its imports.

Python itself would raise KeyboardInterrupt in the middle of an import. Either Python prints a
traceback, or a library catches the exception. In that case the node ignores Ctrl+C, and
roslaunch waits 15 s. As soon as the node runs, :mod:`tb3_labs.ros.node` takes over.

A missing package of Python is reported in one line, too. The build runs this file to report it.
"""
import signal
import sys

# a job that a script starts with `&` ignores SIGINT; a node ends by it, as rospy's own nodes do
if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_IGN):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
try:
    import numpy, squaternion    # noqa: E401, F401 (the other files of this package need them)
except ImportError as missing:    # rosdep was not run
    raise SystemExit(
        'tb3_labs: {} has no package {}. On Noetic, in the workspace: rosdep install --from-paths '
        'src --ignore-src -y. On Debian: source src/tb3_labs/scripts/setup.sh; rm -rf build devel; '
        'catkin_make'.format(sys.executable, missing.name)) from None
