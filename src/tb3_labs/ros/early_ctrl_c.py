"""Import this module first: then Ctrl+C ends a node at once, even during its imports.

Python itself would raise KeyboardInterrupt in the middle of an import. Either Python prints a
traceback, or a library catches the exception. In that case the node runs although it was told to
end, and roslaunch waits 15 s. As soon as the node runs, :mod:`tb3_labs.ros.node` takes over.
"""
import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:    # `&` in a shell ignores SIGINT
    signal.signal(signal.SIGINT, signal.SIG_DFL)
