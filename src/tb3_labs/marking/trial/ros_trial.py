"""Tests a node in the parts of its lab and records the trial.

Each part of a lab has a script, a function that gets a Trial. In a :meth:`Trial.stimulus`, a script
acts on the `node` or the `robot` of the Trial and waits until the `recorder` shows the effect.
"""
import os
import time
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import rospkg
import rospy

from tb3_labs.marking.labs import ros_gamepad, ros_move2goal, ros_turn
from tb3_labs.marking.labs.stimuli import (
    EXIT_SECONDS, EXIT_SIGNAL, EXIT_TIME, LOST_STOP_TIME, STOP_TIME)
from tb3_labs.marking.student_nodes import (
    GAMEPAD, IMU, LAB_NODES, MOVE2GOAL, OWN_PACKAGE, TURN, NodeStart)
from tb3_labs.marking.trial.observation import (
    CTRL_C, MOVED, RESTED, WAS_MOVING, NotOffered, NotTried)
from tb3_labs.marking.trial.ros_recording import Recorder, TrialBag
from tb3_labs.marking.trial.ros_stimuli import DELIVERY_TIME, INTERRUPTION_TIME, Robot
from tb3_labs.marking.trial.ros_student_node import StudentNode
from tb3_labs.marking.trial.source_analysis import read_findings
from tb3_labs.ros.clocks import ros_time, wait_until

#: A node's file is in the folder of its package, or at most this many folders deeper.
MAX_PACKAGE_DEPTH = 3
#: {lab: {part: script}}
SCRIPTS = {IMU: ros_turn.EXERCISE_PARTS, TURN: ros_turn.PARTS, MOVE2GOAL: ros_move2goal.PARTS,
           GAMEPAD: ros_gamepad.PARTS}


class Trial:
    """One robot, one node, and the recording of both."""

    def __init__(self, lab, package, executable, bag_path, pad, print_line):
        """`pad` contains the numbers of the gamepad's axes and buttons. ``print_line(line)`` is
        called to announce each step of the trial."""
        node = f'{package}/{executable}'
        self.bag = TrialBag(bag_path)
        self.bag.add_event('trial', lab=lab, node=node)
        self.recorder = Recorder(self.bag)
        self.robot = Robot(self.recorder)
        self.pad = pad
        self.part = ''
        self.node = StudentNode(node, LAB_NODES[lab].needed_topics, self.bag)
        self._package, self._executable = package, executable
        self._print_line = print_line
        self._slip = 0.0

    @contextmanager
    def stimulus(self, name, facts=()):
        """Record a ``with`` block as a stimulus. The block may add to the stimulus's `facts`."""
        self._print_line(f'{self.part}: {name}')
        self.node.flush()
        begin = self.bag.add_event('begin', name=name)
        stimulus = SimpleNamespace(begin=begin, facts=dict(facts))
        yield stimulus
        self.node.record_state()
        self.bag.add_event('end', facts=stimulus.facts, died=not self.node.is_alive)

    def observe(self, name, seconds, act=lambda: None, facts=()):
        """Record the stimulus `name`: call `act()`, then wait for `seconds` [s]."""
        with self.stimulus(name, facts):
            act()
            time.sleep(seconds)

    @lru_cache(maxsize=None)
    def source_findings(self, *packages):
        """Returns the findings of source_analysis.read_findings in the submission. If mark.py has
        prepared no submission, the findings come from the node's package and from `packages`."""
        submission = NodeStart.from_environment().submission_folder
        if submission:
            return read_findings([submission])
        ros = rospkg.RosPack()
        names = {self._package, *packages} - {OWN_PACKAGE}
        return read_findings([ros.get_path(name) for name in names.intersection(ros.list())])

    def record_assigned_lines(self):
        """Record the lines of the node's file that assign each variable. Record nothing if the
        package has several files with the name of the node's file."""
        program = NodeStart.from_environment().program
        if program:
            files = {program}
        else:
            folder = Path(rospkg.RosPack().get_path(self._package))
            depths = range(MAX_PACKAGE_DEPTH + 1)
            files = {str(path.resolve()) for depth in depths
                     for path in folder.glob('*/' * depth + self._executable)}
        assigned = read_findings(files)['assigned'] if len(files) == 1 else {}
        self.bag.add_event('program', assigned=assigned)

    def skip_part(self, names, reason):
        """Record that the node cannot get the stimuli `names`, and the `reason`, a clause. Then
        raise ``NotOffered``, which ends the part."""
        self.bag.add_event('not offered', names=list(names), reason=reason)
        raise NotOffered(reason)

    def add_remarks(self, sentences):
        for sentence in sentences:
            self.bag.add_event('remark', text=sentence)

    # -- patterns that several labs use

    def act_and_await_motion(self, act, seconds):
        """Call `act()`. Returns True if the node commands a movement within `seconds` [s]."""
        begin = ros_time()
        act()
        wait_until(lambda: self.recorder.node_moved_since(begin) or not self.node.is_alive, seconds)
        return self.recorder.node_moved_since(begin)

    def record_motion(self, name, act, reaction_time, idle_time, max_duration, facts=(),
                      is_astray=lambda: False):
        """Record the stimulus `name`, in which `act()` should make the node move the robot.

        The stimulus ends if no motion begins within `reaction_time` [s]. A motion may last for at
        most `max_duration` [s]. It is over if the robot rests and got no command to move for
        `idle_time` [s], if the node ends, or if `is_astray()` returns True.
        """
        def is_over():
            return not self.node.is_alive or self.recorder.is_at_rest(idle_time) or is_astray()
        with self.stimulus(name, facts) as stimulus:
            stimulus.facts[MOVED] = self.act_and_await_motion(act, reaction_time)
            if stimulus.facts[MOVED]:
                wait_until(is_over, max_duration)
            stimulus.facts[RESTED] = self.recorder.is_at_rest(idle_time)

    def set_in_motion(self, prepare, act, reaction_time):
        """Call `act()`. Returns True if the node moves the robot within `reaction_time` [s].

        If ``prepare()`` returns False, the node is started first. If the robot does not move, there
        is one more attempt with a new process, because a stimulus may have disturbed the node.
        """
        for _ in range(2):
            if not prepare():
                self.node.start()
            if self.act_and_await_motion(act, reaction_time):
                time.sleep(INTERRUPTION_TIME)
                return self.node.is_alive
            self.node.stop()
        self.node.start()
        return False

    def silence_device(self, name, was_moving, end_messages):
        """Record the stimulus `name`, in which `end_messages()` ends the messages of a device."""
        self.observe(name, LOST_STOP_TIME + 0.5, end_messages, {WAS_MOVING: was_moving})

    def silence_sensor(self, name, was_moving, switch):
        """Record the stimulus `name`, in which the robot's setting `switch` makes a sensor silent.
        After the stimulus the sensor sends again."""
        self.silence_device(name, was_moving, lambda: self.robot.change_settings(**{switch: True}))
        self.robot.change_settings(**{switch: False})

    def set_slip(self, share):
        """Make the wheels slip by a share of their travel, from 0 to 1. First end the node, because
        a running node may report the change as a problem of a sensor."""
        if share != self._slip:
            self.node.stop()
            self.robot.change_settings(slip=share)
            self._slip = share

    def send_ctrl_c_in_motion(self, set_in_motion):
        """Send Ctrl+C while the node moves the robot. `set_in_motion()` makes the node move the
        robot and returns True if the robot moves. If the node sends no zero velocity after Ctrl+C,
        try again, up to three times in all."""
        for name in CTRL_C:
            was_moving = set_in_motion()
            begin = ros_time()
            self.send_ctrl_c(name, was_moving)
            zeros = [command_time for command_time, *speeds in self.recorder.commands_since(begin)
                     if not any(speeds)]
            if any(command_time <= begin + STOP_TIME for command_time in zeros):
                return

    def send_ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Send Ctrl+C as the stimulus `name`. Then kill the node if it still runs."""
        with self.stimulus(name, {WAS_MOVING: was_moving}) as stimulus:
            has_ended = self.node.send_ctrl_c(EXIT_TIME)
            if not (has_ended or was_moving):   # input() of Python 3.13 waits for Enter
                self.node.type('')
                has_ended = wait_until(lambda: not self.node.is_alive, STOP_TIME)
            stimulus.facts[EXIT_SECONDS] = ros_time() - stimulus.begin if has_ended else None
            was_ended_by_signal = has_ended and self.node.status < 0
            stimulus.facts[EXIT_SIGNAL] = -self.node.status if was_ended_by_signal else 0
            time.sleep(DELIVERY_TIME)
        self.node.stop()


def exit_at_shutdown(bag):
    """End this process when ROS shuts it down. Otherwise the process would get no more messages,
    and would record that the node does nothing."""
    def on_shutdown():
        if not bag.is_closed:
            bag.add_event('finding', text='The marker was ended while the node ran.')
            bag.close()
            os._exit(1)
    rospy.on_shutdown(on_shutdown)


def record_trial(lab, package, executable, parts, bag_path, pad, print_line):
    """Test a node in the `parts` of a lab, or in all parts if `parts` is empty. Write the bag of
    the trial. The class Trial explains all other arguments."""
    trial = Trial(lab, package, executable, bag_path, pad, print_line)
    exit_at_shutdown(trial.bag)
    try:
        trial.record_assigned_lines()
        for name, act in SCRIPTS[lab].items():
            if not parts or name in parts:
                trial.part = name
                trial.bag.add_event('part', name=name)
                trial.set_slip(0.0)
                print_line(f'{name}: the node is started')
                with suppress(NotOffered, NotTried):    # an untried part does not end the trial
                    act(trial)
    except Exception as error:
        # the node must not lose points because of an error of the marker
        trial.bag.add_event('broken', text=f'{type(error).__name__}: {error}')
        raise
    finally:
        trial.node.stop()
        trial.recorder.finish()
        trial.bag.close()
        if trial.bag.problem:
            raise trial.bag.problem
