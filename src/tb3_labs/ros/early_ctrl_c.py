"""To be imported before all else: Ctrl+C ends a node that still imports its modules, at once.

Python itself would raise KeyboardInterrupt wherever the import is. It prints a traceback, or a
library catches it: the node then runs although it was told to end, and roslaunch waits for it for
15 s. As soon as the node runs, :mod:`tb3_labs.ros.signals` takes over.
"""
import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:    # a shell's `&` has it ignored
    signal.signal(signal.SIGINT, signal.SIG_DFL)
