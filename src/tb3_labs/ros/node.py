"""Start, parameters, signals, failure and end of every node of this package.

An unknown parameter or an invalid value ends the node with one fatal line and exit status 1; its
roslaunch ends, too. An exception inside a callback ends the node as well: rospy alone would print a
traceback and let the robot drive on with its last command. The shutdown hook of
:mod:`tb3_labs.ros.cmd_vel` sends the last zero velocity.

Ctrl+Z stops the robot before it stops the process. rospy's own signal handlers interrupt the main
thread at any point to shut down, and hang if it holds one of rospy's locks. Here a signal is an
exception in the main thread: first it leaves its calls and their locks, then the node shuts down.

Threads and locks
    main         builds the node, then waits without a lock; runs the hooks of Ctrl+Z, and after
                 a signal those of the shutdown
    subscribers  one for each connection of a topic, by rospy; the same for services
    watchdog, keyboard, mouse, pynput's, diagnostics, console, clock_watch, reminders, reset, robot,
    server, master: one each, if a node has them; they are daemons, which do not keep a process
    alive
    Locks are taken in this order, each only before those below it:
    1  locks of all that calls a node back: the shutdown and its hooks, dynamic settings,
       diagnostics, actionlib. A node that calls them, or :func:`end`, holds no lock.
    2  the lock of the node, which guards its core
    3  locks of CmdVel and of Rivals: they guard their own numbers, and call nothing back
    4  locks of rospy's topics, and of the console
    A thread that holds a node's lock does not wait for a terminal, a service or a message. Its
    longest wait is in CmdVel, for the last zero, when the node does not drive any more.
"""
import faulthandler
import functools
import math
import os
import select
import signal
import sys
import threading
import traceback
from dataclasses import fields

import rosgraph
import rospy

from tb3_labs.config import NOT_GIVEN, from_parameters, nearest
from tb3_labs.robot.turtlebot3 import model_called
from tb3_labs.ros import console
from tb3_labs.ros.clocks import say_if_no_clock_comes, wait_until
from tb3_labs.ros.launch import end_roslaunch
from tb3_labs.ros.rospy_internals import after_hooks, is_ending, mend_registration

#: Time between two looks for a master [s].
MASTER_PERIOD = 0.5
#: A node that ends, after its last zero, waits no longer than this for its master's answer [s].
LONGEST_END = 4.0
#: These end a node: Ctrl+C, `kill`, a closed terminal.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: This byte wakes the main thread when rospy has shut down; for a signal it is the signal's number.
SHUT_DOWN = b'\xff'

_failures = []
_sleepers = []    # (function to call before the process is stopped, function to call after)


def run(name, make_node):
    """Initialise node `name`, build it by ``make_node()``, wait for the end; exits the process.

    With --help the docstring of the script of the class `make_node` is printed.
    """
    if set(rospy.myargv()[1:]) & {'-h', '--help'}:
        print(make_node.__init__.__globals__['__doc__'].strip())
        sys.exit(0)
    signals = Signals()
    node = None
    try:
        _wait_for_master()
        rospy.init_node(name, disable_signals=True)
        rospy.on_shutdown(_end_in_time)    # the first of the hooks
        mend_registration()
        console.start()
        say_if_no_clock_comes()
        after_hooks(signals.wake)    # by then the last zero velocity is sent
        node = make_node()
        signals.take_ctrl_z()
        signals.wait()
    except ValueError as problem:
        signals.ignore()
        end(str(problem))
        end_roslaunch()
    except Interrupted:
        rospy.signal_shutdown('signal')
    signals.ignore()
    del node
    status = 1 if _failures else 0
    if not console.flush():
        os._exit(status)    # skips Python's own end, see console.flush
    sys.exit(status)


def _wait_for_master():
    """Wait until a master answers. rospy does not wait if the command line has parameters."""
    if not _master_answers():
        console.say('Waiting for a ROS master at {}: roslaunch starts one, roscore too'.format(
            rosgraph.get_master_uri()))
        wait_until(_master_answers, math.inf, MASTER_PERIOD)


def _master_answers():
    try:
        rosgraph.Master(rospy.get_caller_id()).getPid()
    except OSError:
        return False
    return True


def _end_in_time():
    timer = threading.Timer(LONGEST_END, lambda: os._exit(1 if _failures else 0))
    timer.daemon = True
    timer.start()


def read_config(*kinds, of=None):
    """Returns an instance of each configuration class in `kinds`, from the node's ``~`` parameters.
    ``ValueError`` for the first parameter that is unknown or not valid.

    `of` names another node whose parameters are read instead; unknown ones of it are ignored.
    """
    given = rospy.get_param(of or '~', {})
    known = {item.name for kind in kinds for item in fields(kind)} | {'model'}
    for name in () if of else sorted(set(given) - known):
        raise ValueError('parameter {}/{} is unknown; {}'.format(
            rospy.get_name(), name, nearest(name, known)))
    try:
        configs = [from_parameters(kind, given) for kind in kinds]
    except ValueError as problem:
        raise ValueError('parameter {}/{}'.format(of or rospy.get_name(), problem)) from None
    return configs[0] if len(configs) == 1 else configs


def read_model():
    """Returns the RobotModel called ``~model``, else the one that TURTLEBOT3_MODEL names."""
    return model_called(rospy.get_param('~model', NOT_GIVEN), os.environ)


def guarded(callback):
    """Returns `callback`, but an exception in it ends the node with one fatal line."""
    @functools.wraps(callback)
    def call(*args, **kwargs):
        try:
            return callback(*args, **kwargs)
        except rospy.ServiceException:
            raise  # a refusal, which rospy passes to the caller
        except rospy.ROSException:
            # publishing while the node ends and its topics are closed is not a failure
            if not is_ending():
                raise
        except Exception as problem:  # after any exception the robot must not drive on
            where = traceback.extract_tb(sys.exc_info()[2])[-1]
            rospy.logdebug('%s', traceback.format_exc())
            end('{}: {} ({} line {})'.format(type(problem).__name__, problem,
                                             os.path.basename(where.filename), where.lineno))
    return call


def end(failure=''):
    """End this node; if there is a `failure`, with one fatal line and exit status 1."""
    if failure:
        _failures.append(failure)
        if len(_failures) == 1:    # other threads may fail, too, until the node has ended
            rospy.logfatal('%s', failure)
    rospy.signal_shutdown(failure or 'done')


# ----- signals -----

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
        """Wait for :meth:`wake`, or at most for `seconds`; then any signal ends the wait. A signal
        of ENDING raises Interrupted, here and everywhere else."""
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
        """Ignore further signals: a second one must not interrupt the shutdown, and Ctrl+Z would
        wait for ever for a lock that the main thread holds."""
        for number in ENDING + (signal.SIGTSTP,):
            signal.signal(number, signal.SIG_IGN)

    def _interrupt(self, _number, _frame):
        self.ignore()
        self._signalled.set()
        raise Interrupted


def when_stopped(before, after):
    """Call `before()` before Ctrl+Z stops the process, and `after()` when the process goes on.
    Both are called in the main thread, without a lock."""
    _sleepers.append((before, after))


def _sleep(_number, _frame):
    for before, _ in _sleepers:
        before()
    os.kill(os.getpid(), signal.SIGSTOP)    # the process stands here until it is continued
    for _, after in _sleepers:
        after()
