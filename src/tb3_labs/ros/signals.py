"""The signals of a node: three end it, Ctrl+Z stops the robot before it stops the process.

rospy's own signal handlers interrupt the main thread at any point to shut down, and hang if it
holds one of rospy's locks. Here a signal is an exception in the main thread: first the thread
leaves its calls and their locks, then the node shuts down once.
"""
import faulthandler
import os
import select
import signal
import threading

#: These end a node: Ctrl+C, `kill`, a closed terminal.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: This byte in the pipe wakes the main thread when rospy has shut down. For a signal the byte is
#: the signal's number.
SHUT_DOWN = b'\xff'

_sleepers = []    # (function to call before the process is stopped, function to call after)


class Interrupted(BaseException):
    """A signal of ENDING; a BaseException, so that no ``except Exception`` catches it."""


class Signals:
    """Handles the signals of this process from now on; to be made in the main thread."""

    def __init__(self):
        self._signalled = threading.Event()
        # on `kill -USR1` a node prints where each of its threads is
        faulthandler.register(signal.SIGUSR1)
        # A thread that is just about to wait for a lock misses a signal, and waits for ever. A pipe
        # avoids that: the interpreter writes a byte into it whenever a signal arrives.
        self._over, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        signal.set_wakeup_fd(self._wake)
        for number in ENDING:
            if signal.getsignal(number) is not signal.SIG_IGN:    # nohup ignores SIGHUP
                signal.signal(number, self._interrupt)

    def wake(self):
        """End :meth:`wait`, from any thread."""
        os.write(self._wake, SHUT_DOWN)

    def wait(self, seconds=None):
        """Wait for :meth:`wake`, or at most for `seconds`. A signal of ENDING raises Interrupted,
        in this method and everywhere else. Another signal ends the wait if `seconds` are given."""
        while select.select([self._over], [], [], seconds)[0]:
            is_over = os.read(self._over, 1) == SHUT_DOWN or self._signalled.is_set()
            if is_over or seconds is not None:
                break
        if self._signalled.is_set():
            raise Interrupted    # a library caught the first one by a bare `except:`

    @staticmethod
    def take_ctrl_z():
        """Let Ctrl+Z (SIGTSTP) call the functions of :func:`when_stopped` from now on."""
        if signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL:
            signal.signal(signal.SIGTSTP, _sleep)

    @staticmethod
    def ignore():
        """Ignore further signals. A second one must not interrupt the shutdown. Ctrl+Z would wait
        for ever for a lock that the main thread holds while it shuts down."""
        for number in ENDING + (signal.SIGTSTP,):
            signal.signal(number, signal.SIG_IGN)

    def _interrupt(self, _number, _frame):
        self.ignore()
        self._signalled.set()
        raise Interrupted


def when_stopped(before, after):
    """Call `before()` before Ctrl+Z stops the process, and `after()` when it goes on; both in the
    main thread, which holds no lock then."""
    _sleepers.append((before, after))


def _sleep(_number, _frame):
    for before, _ in _sleepers:
        before()
    os.kill(os.getpid(), signal.SIGSTOP)    # the process stands here until it is continued
    for _, after in _sleepers:
        after()
