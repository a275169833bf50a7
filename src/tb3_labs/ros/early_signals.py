"""A node imports this module first. After this import Ctrl+C ends the node immediately.

Python itself would raise KeyboardInterrupt in the middle of an import. If nothing catches the
exception, Python prints a traceback. If a library catches the exception, the node ignores Ctrl+C,
and roslaunch waits 15 s. After the imports, :mod:`tb3_labs.ros.node` catches the signals. If a
Python package is missing, this module ends the program, or the build, with one line.
"""
import signal
import sys

# A job that a script starts with `&` ignores SIGINT. But SIGINT must end every node.
if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_IGN):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
try:
    import numpy, squaternion    # noqa: E401, F401 (other files of tb3_labs need them)
except ImportError as error:    # rosdep was not run
    raise SystemExit(
        'tb3_labs: {} has no package {}. On Noetic, in the workspace: rosdep install --from-paths '
        'src --ignore-src -y. On Debian: source src/tb3_labs/scripts/setup.sh; rm -rf build devel; '
        'catkin_make'.format(sys.executable, error.name)) from None
