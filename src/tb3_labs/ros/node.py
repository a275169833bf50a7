"""Starts a node of this package, and ends the node after a signal or a failure.

A ``ValueError`` at the start, such as for an invalid parameter, ends the node and its roslaunch.
The node logs one fatal line, and its exit status is 1. An exception in a callback also ends the
node. rospy alone would only log such an exception, and the robot would follow its last command.

The signal handlers of rospy hang if the main thread holds a lock of rospy. So in a node of this
package, a signal raises the exception Interrupted in the main thread. This exception first ends all
calls of the main thread, which releases their locks. Then :func:`run_node` shuts down the node, and
:mod:`tb3_labs.ros.cmd_vel` stops the robot. Ctrl+Z also ends a node, since a suspended process
could not stop the robot.
"""
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
    join_publisher_lists, log_without_the_master, record_connections, serve_connections_in_threads)
from tb3_labs.safe_output import SafeStream

MAIN_THREAD_POLL_PERIOD = 0.2    # [s]
FLUSH_TIME = 0.1                 # time [s] for rospy's queues to send the last messages
#: A node that ends waits at most this time [s] for its shutdown hooks and for the master.
END_TIMEOUT = 4.0
END_POLL_PERIOD = 0.01    # [s]
XML_RPC_LIMIT_TEXT = 'int exceeds XML-RPC limits'
#: The signals that end a node: Ctrl+C, `kill`, a closed terminal, Ctrl+Z.
END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP)

_failures = []
_received_signals = []
_shutdown_has_begun = threading.Event()    # rospy.is_shutdown() is false until the hooks have run


def run_node(name, start_node, interface):
    """Initialise the node `name`, call ``start_node()``, wait until the node ends, and exit. With
    the option --help, only print `interface` and exit."""
    sys.stdout, sys.stderr = SafeStream(sys.stdout), SafeStream(sys.stderr)
    if {'-h', '--help'} & set(rospy.myargv()[1:]):
        print(interface.strip())
        sys.exit(0)
    catch_signals()
    try:
        _wait_for_master()
        rospy.init_node(name, disable_signals=True)
        rospy.on_shutdown(_shutdown_has_begun.set)
        log_without_the_master()
        serve_connections_in_threads()
        join_publisher_lists()
        record_connections()
        node = start_node()    # noqa: F841 (without this name Python would delete the node)
        rospy.on_shutdown(_log_failure)
        while not _shutdown_has_begun.is_set():
            interruptible_sleep(MAIN_THREAD_POLL_PERIOD)
    except (ValueError, OverflowError) as error:
        ignore_signals()
        end_roslaunch()
        failure = str(error).replace(XML_RPC_LIMIT_TEXT, 'a whole number beyond 2147483647')
        begin_shutdown(failure)
    except Interrupted:
        begin_shutdown()
    ignore_signals()
    exit_process()


def _wait_for_master():    # rospy itself would not wait if a user typed a parameter
    if rosgraph.is_master_online():
        return
    print(f'Waiting for a ROS master at {rosgraph.get_master_uri()}: roslaunch starts one, '
          'roscore too')
    while not rosgraph.is_master_online():
        interruptible_sleep(MAIN_THREAD_POLL_PERIOD)


def exit_process(status=0):
    """Wait for the shutdown hooks, and exit with `status`, or with 1 after a failure."""
    deadline = time.monotonic() + END_TIMEOUT
    while not rospy.is_shutdown() and time.monotonic() < deadline:
        time.sleep(END_POLL_PERIOD)
    sys.stdout.flush()
    os._exit(1 if _failures else status)    # rospy would exit 0.6 s later


def guarded(callback):
    """Returns a function that calls `callback`. An exception ends the node with one fatal line."""
    def call(*args, **kwargs):
        try:
            return callback(*args, **kwargs)
        except rospy.ServiceException:
            raise    # rospy sends the reason to the client
        except Exception as error:    # after any exception the robot must not drive on
            *_, raised_in = traceback.extract_tb(error.__traceback__)
            place = f'{os.path.basename(raised_in.filename)} line {raised_in.lineno}'
            rospy.logdebug('%s', traceback.format_exc())
            # while the node ends, a publisher that is closed already may raise an exception
            if not (_shutdown_has_begun.is_set() or rospy.is_shutdown()):
                begin_shutdown(f'{type(error).__name__}: {error} ({place})')
    return call


def begin_shutdown(failure=''):
    """Start to shut down this node, without waiting for the shutdown hooks. A `failure` is logged
    as one fatal line and sets the exit status to 1."""
    _shutdown_has_begun.set()
    if failure:
        _failures.append(failure)
    threading.Thread(target=_shut_down, args=[failure], daemon=True).start()


def _shut_down(failure):
    if failure and failure == _failures[0]:    # only the first failure is logged
        rospy.on_shutdown(lambda: _log_failure(failure))
    rospy.signal_shutdown(failure or 'done')


def _log_failure(failure=''):
    """Log the failure last, since a blocked terminal must not delay the zero command."""
    if failure:
        rospy.logfatal('%s', failure)
    time.sleep(FLUSH_TIME)


def parent_roslaunch():
    """Returns the process id of the roslaunch that started this process, or 0."""
    argv = Path(f'/proc/{os.getppid()}/cmdline').read_text().split('\0')
    is_roslaunch = 'roslaunch' in map(os.path.basename, argv[:2])    # argv[0] may be python3
    return os.getppid() if is_roslaunch else 0


def end_roslaunch():
    """End the roslaunch that started this process. After SIGTERM roslaunch prints no red lines."""
    roslaunch = parent_roslaunch()
    if roslaunch:
        os.kill(roslaunch, signal.SIGTERM)


class Interrupted(BaseException):
    """A signal of END_SIGNALS arrived. ``except Exception`` does not catch a BaseException."""


def catch_signals():
    """From now on the first signal of END_SIGNALS raises Interrupted in the main thread, even in a
    background job. A node that was started by nohup still ignores SIGHUP."""
    for end_signal in END_SIGNALS:
        if end_signal != signal.SIGHUP or signal.getsignal(end_signal) is not signal.SIG_IGN:
            signal.signal(end_signal, _interrupt)


def _interrupt(received_signal, _frame):
    ignore_signals()
    _received_signals.append(received_signal)
    raise Interrupted


def ignore_signals():
    """Ignore further signals, since a second signal must not interrupt the shutdown."""
    for end_signal in END_SIGNALS:
        signal.signal(end_signal, signal.SIG_IGN)


def interruptible_sleep(seconds):
    """Sleep in the main thread. Raises Interrupted if a signal arrives. If a signal arrived before,
    raises Interrupted again, because a library may have caught the first exception."""
    if not _received_signals:
        time.sleep(seconds)
    if _received_signals:
        raise Interrupted
