"""The trial of a node: one robot, one node, and the recording of both.

The script of a lab's part acts on `node` and `robot` within a :meth:`Trial.stimulus`, and looks at
`recorder`.
"""
import os
import time
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import rospkg
import rospy

from tb3_labs.marking.intake.sandbox import OWN_PACKAGE, Launch
from tb3_labs.marking.labs import ros_gamepad, ros_move2goal, ros_turn
from tb3_labs.marking.labs.criteria import AT_ONCE, ENDING, LOST_AFTER, SIGNAL, TOOK
from tb3_labs.marking.names import GAMEPAD, IMU, LAB_NODES, MOVE2GOAL, TURN
from tb3_labs.marking.trial.observation import (
    CTRL_C, MOVED, RESTED, WAS_MOVING, NotOffered, NotTried)
from tb3_labs.marking.text import lint
from tb3_labs.marking.text.source_analysis import text_of
from tb3_labs.marking.trial.ros_recording import Recorder, Recording
from tb3_labs.marking.trial.ros_stimuli import UNDER_WAY, WELL_UNDER_WAY, Robot
from tb3_labs.marking.trial.ros_student_node import StudentNode
from tb3_labs.ros.clocks import wait_until

#: A node's file lies in so many folders of its package, at most.
DEPTH = 4
#: lab -> part -> its script, given a Trial
SCRIPTS = {IMU: ros_turn.EXERCISE_PARTS, TURN: ros_turn.PARTS, MOVE2GOAL: ros_move2goal.PARTS,
           GAMEPAD: ros_gamepad.PARTS}


class Trial:
    """One robot, one node, and the recording of both."""

    def __init__(self, lab, package, executable, path, option, print_line):
        """`path`: of the bag; `option`: the value of the lab's option. ``print_line(words)`` is
        called with the present step."""
        node = f'{package}/{executable}'
        self.recording = Recording(path)
        self.recording.event('trial', lab=lab, node=node)
        self.recorder = Recorder(self.recording)
        self.robot, self.option, self.part = Robot(self.recorder), option, ''
        self.node = StudentNode(node, LAB_NODES[lab].sensors, self.recording)
        self._name, self._print_line, self._slip = node, print_line, 0.0

    @contextmanager
    def stimulus(self, name, facts=None):
        """Record the node's behaviour within the ``with`` block as the stimulus `name`, with these
        `facts`, and those that the block adds."""
        self._print_line(f'{self.part}: {name}')
        self.node.flush()
        record = SimpleNamespace(begin=self.recording.event('begin', name=name),
                                 facts=dict(facts or {}))
        yield record
        self.node.note()
        self.recording.event('end', facts=record.facts, died=not self.node.alive)

    def watch(self, name, seconds, act=lambda: None, facts=None):
        """Record `act()` and the `seconds` [s] after it as the stimulus `name`, with `facts`."""
        with self.stimulus(name, facts):
            act()
            time.sleep(seconds)

    @lru_cache(maxsize=None)
    def text(self, *packages):
        """What the text of the submission shows, or of these packages; see source_analysis. The
        mouse client of the node's own package comes first."""
        known = rospkg.RosPack()
        own, *others = [
            [known.get_path(name)] if name != OWN_PACKAGE and name in known.list() else []
            for name in dict.fromkeys((self._name.split('/')[0], *packages))]
        copy = Launch.from_environment().copy
        found = text_of([copy] if copy else sum(others, own))
        return dict(found, up=text_of(own)['up'] or found['up'])

    def read(self):
        """Record what the text of the node's file shows, before it runs; see lint. A file whose
        name its package has twice is not known."""
        package, name = self._name.split('/')
        text = Launch.from_environment().text
        files = {Path(text)} if text else {
            path.resolve() for depth in range(DEPTH)
            for path in Path(rospkg.RosPack().get_path(package)).glob('*/' * depth + name)}
        faults, assigned = lint.read(files.pop()) if len(files) == 1 else ([], {})
        for fault in faults:
            self.recording.event('fault', text=fault)
        self.recording.event('program', assigned=assigned)

    def not_offered(self, names, reason):
        """End the part by ``NotOffered``: the node does not offer what these stimuli need."""
        self.recording.event('not offered', names=list(names), reason=reason)
        raise NotOffered(reason)

    def remark(self, sentences):
        """Record these sentences for the student."""
        for sentence in sentences:
            self.recording.event('remark', text=sentence)

    # -- patterns that several labs use

    def moves_after(self, act, seconds):
        """Call `act()`. Does the node command a movement within `seconds` [s]?"""
        begun = self.recorder.now
        act()
        wait_until(lambda: self.recorder.moves(begun) or not self.node.alive, seconds)
        return self.recorder.moves(begun)

    def motion(self, name, act, reaction, quiet, seconds, facts=(), is_astray=lambda: False):
        """Record a motion as the stimulus `name`: `act()` should make the node move the robot
        within `reaction` [s]. It is over if the robot rests without a command for `quiet` [s], or
        is astray, and after `seconds` [s] at the latest."""
        with self.stimulus(name, facts) as record:
            record.facts[MOVED] = self.moves_after(act, reaction)
            if record.facts[MOVED]:
                wait_until(lambda: not self.node.alive or self.recorder.rests(quiet)
                           or is_astray(), seconds)
            record.facts[RESTED] = self.recorder.rests(quiet)

    def set_in_motion(self, is_ready, act, reaction):
        """Have the node move the robot. Returns True in the middle of the motion, False if the
        node does not move the robot.

        `is_ready()`: does the node run, and wait? If not, it is started. `act()` should make it
        move within `reaction` [s].
        """
        for _ in range(2):
            if not is_ready():
                self.node.start()
            if self.moves_after(act, reaction):
                time.sleep(WELL_UNDER_WAY)
                return self.node.alive
            self.node.stop()        # an earlier stimulus may have upset it: start it again
        self.node.start()
        return False

    def falls_silent(self, name, was_moving, silence):
        """Record the stimulus of a sensor or an input; `silence()` ends its messages."""
        self.watch(name, LOST_AFTER + 0.5, silence, {WAS_MOVING: was_moving})

    def sensor_falls_silent(self, name, was_moving, switch):
        """Record the stimulus of a silent sensor; the robot's setting `switch` makes it silent."""
        self.falls_silent(name, was_moving, lambda: self.robot.change(**{switch: True}))
        self.robot.change(**{switch: False})

    def set_slip(self, share):
        """From now on the wheels lose this share of their travel. A node may take a sudden change
        for a fault of its sensors: it is ended before."""
        if share != self._slip:
            self.node.stop()
            self.robot.change(slip=share)
            self._slip = share

    def ctrl_c_in_motion(self, set_in_motion):
        """Send Ctrl+C while the node moves the robot; again if the node sends no zero velocity.

        `set_in_motion()` returns what :meth:`set_in_motion` returns.
        """
        for name in CTRL_C:
            moving, begin = set_in_motion(), self.recorder.now
            self.ctrl_c(name, moving)
            if any(not (linear or angular) and at <= begin + AT_ONCE
                   for at, linear, angular in self.recorder.commands_since(begin)):
                return

    def ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Send Ctrl+C and wait; afterwards the node has ended in any case."""
        with self.stimulus(name, {WAS_MOVING: was_moving}) as record:
            ended = self.node.interrupt(ENDING)
            if not (ended or was_moving):   # Python 3.13 ends when input() does, which awaits Enter
                self.node.type('')
                ended = wait_until(lambda: not self.node.alive, AT_ONCE)
            record.facts[TOOK] = self.recorder.now - record.begin if ended else None
            record.facts[SIGNAL] = max(0, -self.node.status) if ended else 0
            time.sleep(UNDER_WAY)
        self.node.stop()


def end_with_the_marker(recording):
    """A marker that was shut down hears nothing, and would observe wrongly: it ends at once."""
    def on_shutdown():
        if not recording.is_closed:
            recording.event('finding', text='The marker was ended while the node ran.')
            recording.close()
            os._exit(1)
    rospy.on_shutdown(on_shutdown)


def try_out(lab, package, executable, parts, path, option, print_line):
    """Start a node, try `parts` of its lab, [] for all of them, and record it.

    Trial explains the other arguments.
    """
    trial = Trial(lab, package, executable, path, option, print_line)
    end_with_the_marker(trial.recording)
    try:
        trial.read()
        for name, act in SCRIPTS[lab].items():
            if not parts or name in parts:
                trial.part = name
                trial.recording.event('part', name=name)
                trial.set_slip(0.0)
                print_line(f'{name}: the node is started')
                with suppress(NotOffered, NotTried):    # the rest of the part cannot be tried
                    act(trial)
    except Exception as problem:
        # a stimulus that was not tried must not look like a failure of the node
        trial.recording.event('broken', text=f'{type(problem).__name__}: {problem}')
        raise
    finally:
        trial.node.stop()
        trial.recorder.finish()
        trial.recording.close()
        if trial.recording.problem:
            raise trial.recording.problem
