"""Start, signals, failure and end of every node of this package.

A ``ValueError`` at the start, such as an invalid parameter's, ends the node with one fatal
line and exit status 1; its roslaunch ends, too. An exception inside a callback ends the node as
well: rospy alone would let the robot drive on with its last command.

rospy's own signal handlers hang if the main thread holds one of rospy's locks. Here a signal raises
an exception in the main thread, which first leaves its calls and their locks; then the node shuts
down. Ctrl+Z ends a node, too, since a stopped process could not stop its robot. The zero command at
the end is sent by :mod:`tb3_labs.ros.core_runner`.
"""
import functools
import os
import signal
import sys
import threading
import time
import traceback
from pathlib import Path

import rosgraph
import rospy

from tb3_labs.ros.rospy_internals import (
    answer_side_by_side, find_late_publishers, log_without_the_master, note_connections)
from tb3_labs.terminal import SafeStream

#: Period of the main thread: does a master answer, has another thread ended the node? [s]
MAIN_PERIOD = 0.2
#: Time for rospy's queues to send the last messages [s].
LOG_TIME = 0.1
#: A node that ends waits this long for its hooks and its master, and checks with this period [s].
LONGEST_END, END_POLL = 4.0, 0.01
#: These end a node: Ctrl+C, `kill`, a closed terminal, Ctrl+Z.
END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP)

_failures = []
_signals = []     # numbers of the signals of END_SIGNALS so far
_end_has_begun = threading.Event()    # rospy.is_shutdown() is true only after its hooks


def run(name, make_node, interface=None):
    """Initialise node `name`, build it by ``make_node()``, wait for its end, and exit. --help
    prints the `interface`, by default the docstring of the file of `make_node`."""
    sys.stdout, sys.stderr = SafeStream(sys.stdout), SafeStream(sys.stderr)
    if set(rospy.myargv()[1:]) & {'-h', '--help'}:
        print((interface or make_node.__init__.__globals__['__doc__']).strip())
        sys.exit(0)
    catch_signals()
    try:
        if not rosgraph.is_master_online():    # rospy does not wait if parameters are typed
            print(f'Waiting for a ROS master at {rosgraph.get_master_uri()}: roslaunch starts one, '
                  'roscore too')
            while not rosgraph.is_master_online():
                pause(MAIN_PERIOD)
        rospy.init_node(name, disable_signals=True)
        rospy.on_shutdown(_end_has_begun.set)
        log_without_the_master()
        answer_side_by_side()
        find_late_publishers()
        note_connections()
        node = make_node()    # noqa: F841 (it lives as long as this name)
        rospy.on_shutdown(_log_failure)
        while not _end_has_begun.is_set():
            pause(MAIN_PERIOD)
    except (ValueError, OverflowError) as problem:    # the latter: an integer that rospy cannot set
        ignore_signals()
        end_roslaunch()
        end(str(problem).replace('int exceeds XML-RPC limits', 'a whole number beyond 2147483647'))
    except Interrupted:
        end()
    ignore_signals()
    leave()


def leave(status=0):
    """End this process when its hooks are done, without the 0.6 s that rospy's own end takes."""
    deadline = time.monotonic() + LONGEST_END
    while not rospy.is_shutdown() and time.monotonic() < deadline:
        time.sleep(END_POLL)
    sys.stdout.flush()
    os._exit(1 if _failures else status)


def guarded(callback):
    """Returns `callback`, but an exception in it ends the node with one fatal line."""
    @functools.wraps(callback)
    def call(*args, **kwargs):
        try:
            return callback(*args, **kwargs)
        except rospy.ServiceException:
            raise  # a refusal, which rospy passes to the caller
        except Exception as problem:  # after any exception the robot must not drive on
            where = traceback.extract_tb(sys.exc_info()[2])[-1]
            rospy.logdebug('%s', traceback.format_exc())
            # while the node ends, a topic may be closed
            if not (_end_has_begun.is_set() or rospy.is_shutdown()):
                place = f'{os.path.basename(where.filename)} line {where.lineno}'
                end(f'{type(problem).__name__}: {problem} ({place})')
    return call


def end(failure=''):
    """Begin to end this node, and do not wait for its hooks. A `failure` is logged as one fatal
    line, and makes the exit status 1."""
    _end_has_begun.set()
    if failure:
        _failures.append(failure)
    threading.Thread(target=_shut_down, args=[failure], daemon=True).start()


def _shut_down(failure):
    if failure and failure == _failures[0]:    # other threads may fail, too
        rospy.on_shutdown(lambda: _log_failure(failure))
    rospy.signal_shutdown(failure or 'done')


def _log_failure(failure=''):
    """The last hook of the shutdown: a blocked terminal must not delay the last zero command."""
    if failure:
        rospy.logfatal('%s', failure)
    time.sleep(LOG_TIME)


def roslaunch_of_this():
    """Returns the id of the roslaunch that started this process; 0 if another program did."""
    words = Path(f'/proc/{os.getppid()}/cmdline').read_text().split('\0')
    is_roslaunch = 'roslaunch' in map(os.path.basename, words[:2])    # or python is first
    return os.getppid() if is_roslaunch else 0


def end_roslaunch():
    """End the roslaunch that started this process as Ctrl+C does, without its red lines."""
    if roslaunch_of_this():
        os.kill(roslaunch_of_this(), signal.SIGTERM)


class Interrupted(BaseException):
    """A signal of END_SIGNALS; a BaseException, so that no ``except Exception`` catches it."""


def catch_signals():
    """Let the first signal of END_SIGNALS raise Interrupted in the main thread, also SIGINT that a
    script's background job ignores; but a SIGHUP that nohup ignores stays ignored."""
    for number in END_SIGNALS:
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number, _frame):
    ignore_signals()
    _signals.append(number)
    raise Interrupted


def ignore_signals():
    """Ignore further signals: a second one must not interrupt the shutdown."""
    for number in END_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def pause(seconds):
    """Sleep in the main thread. Raises Interrupted if a signal arrives, or has arrived before and a
    library caught its exception, by a bare `except:`."""
    if not _signals:
        time.sleep(seconds)
    if _signals:
        raise Interrupted
