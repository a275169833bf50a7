"""How every node of this package starts, sleeps, fails and ends.

A bad configuration is one fatal line and exit status 1. An exception inside a callback ends
the node: rospy alone would print a traceback and let the robot drive on with its last command.
SIGINT (Ctrl+C), SIGTERM and SIGHUP (its terminal was closed) end it as well. The zero velocity on
the way out is :mod:`tb3_labs.ros.cmd_vel`'s shutdown hook. SIGTSTP (Ctrl+Z) stops the robot before
it stops the process.
"""
import faulthandler
import functools
import os
import signal
import sys
import threading
import time
import traceback

import rospy

from tb3_labs.control.pace import Listening
from tb3_labs.ros.console import Console
from tb3_labs.ros.sim_clock import say_if_no_clock_comes

#: What ends a node.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: Wakes the main thread when rospy has shut down; a signal does so by its number.
SHUT_DOWN = b'\xff'

_failures = []
_signalled = threading.Event()
_sleepers = []    # (what to do before the process is stopped, and after it)
_console = None


class _Interrupted(BaseException):
    """One of SIGNALS; not an Exception, so that no handler on the way up takes it for one."""


def run(name, make_node):
    """Initialise node `name`, build it by ``make_node()``, wait for the end; exits the process.

    rospy's own signal handlers shut down in the middle of whatever the main thread is doing, and
    hang where that holds one of rospy's locks. Here a signal is an exception in the main thread:
    it unwinds first, then the node shuts down once.
    """
    global _console
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:    # as nohup wants it
            signal.signal(number, _interrupt)
    # `kill -USR1` has a node print where each of its threads is
    faulthandler.register(signal.SIGUSR1)
    # A thread that is just about to wait for a lock misses a signal, and waits for ever; with a
    # pipe it does not: the interpreter writes a byte into it whenever a signal arrives.
    over, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake)
    node = None
    try:
        rospy.init_node(name, disable_signals=True)
        _console = Console()
        say_if_no_clock_comes()
        # after all of on_shutdown's hooks, by which the last zero velocity is out
        rospy.core.add_preshutdown_hook(lambda reason: os.write(wake, SHUT_DOWN))
        node = make_node()
        if signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL:
            signal.signal(signal.SIGTSTP, _sleep)
        while os.read(over, 1) != SHUT_DOWN and not _signalled.is_set():
            pass    # a signal that does not end it
        if _signalled.is_set():
            raise _Interrupted    # where a library caught it by a bare `except:`
    except ValueError as problem:
        end(str(problem))
    except _Interrupted:
        rospy.signal_shutdown('signal')
    del node
    status = 1 if _failures else 0
    if _console is not None and not _console.flush():
        os._exit(status)    # the interpreter would wait for the terminal, for ever
    sys.exit(status)


def _interrupt(_number, _frame):
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # one is enough; a second must not cut the end short
    _signalled.set()
    raise _Interrupted


def when_stopped(before, after):
    """Have `before()` called when the process is about to be stopped by Ctrl+Z, and `after()` when
    it goes on."""
    _sleepers.append((before, after))


def _sleep(_number, _frame):
    for before, _ in _sleepers:
        before()
    os.kill(os.getpid(), signal.SIGSTOP)    # here the process stands until it is continued
    for _, after in _sleepers:
        after()


def say(text):
    """Print a text that is no log line, in order with the log lines."""
    if _console is None:
        print(text, flush=True)
    else:
        _console.say(text)


def guarded(callback):
    """`callback`, except that an exception in it ends the node with one fatal line."""
    @functools.wraps(callback)
    def call(*args, **kwargs):
        try:
            return callback(*args, **kwargs)
        except rospy.ServiceException:
            raise  # a refusal, which rospy hands to the caller
        except rospy.ROSException:
            # publishing on the way out, when the topics are closing, is no failure
            if not rospy.core.is_shutdown_requested():
                raise
        except Exception as problem:  # whatever it is, the robot must not drive on
            where = traceback.extract_tb(sys.exc_info()[2])[-1]
            rospy.logdebug('%s', traceback.format_exc())
            end('{}: {} ({} line {})'.format(type(problem).__name__, problem,
                                             os.path.basename(where.filename), where.lineno))
    return call


def end(failure=''):
    """End this node; with a `failure` by one fatal line and exit status 1."""
    if failure:
        _failures.append(failure)
        rospy.logfatal('%s', failure)
    rospy.signal_shutdown(failure or 'done')


def subscribe(topic, kind, callback, read=None, source=None, queue_size=1, idle_for=None):
    """A guarded subscriber of the newest message, or of the newest `queue_size` that came at once;
    None: of all.

    `read` turns the message into what `callback` wants; where it raises ``ValueError`` the message
    is dropped with one warning a second, and counted by `source`, the freshness.Freshness of this
    topic. A large receive buffer goes with queue_size=1: when the node is late, what is stale is
    dropped, and not even deserialised.

    `idle_for(now)`, in [s], makes use of that: the topic is read in the rhythm of the node's steps,
    see :mod:`tb3_labs.control.pace`. By simulated time, whose pace is unknown, every message is
    read.
    """
    in_rhythm = idle_for is not None and rospy.rostime.is_wallclock()
    listening = Listening(idle_for) if in_rhythm else None

    def handle(message):
        try:
            value = message if read is None else read(message)
        except ValueError as problem:
            rospy.logwarn_throttle(1.0, 'bad message on {} dropped: {}'.format(topic, problem))
            if source is not None:
                source.dropped += 1
            return
        callback(value)
        if listening is not None:
            time.sleep(listening.rest(rospy.get_time()))

    return rospy.Subscriber(topic, kind, guarded(handle), queue_size=queue_size,
                            buff_size=65536, tcp_nodelay=True)
