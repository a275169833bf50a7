"""The worlds of stories: nodes, persons, a network, and the events that can happen.

An event is (words for a story, name of a method, its arguments). Units: seconds.
"""
from types import SimpleNamespace

from reference_rule import COMPARED, OVER, GoalRule
from story_nodes import CLOCK, TICK, Ahead, Mover, PadNode, Wrong
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.events import SenderConnection
from tb3_labs.supervision.timeouts import MAX_TRANSIT_TIME

#: A program repeats its goal with this period.
PERIOD = 0.3
#: The answer of an event that is impossible.
NOTHING = object()

#: Just below and above each limit: 0.04 (confirmation), 0.2 to 0.3 (pad, mouse, waking, crossing), 0.5 (lapse), 2.0
#: (longest lapse).
WAITING = [('{} s pass'.format(seconds), 'let_pass', seconds)
           for seconds in (0.03, 0.06, 0.24, 0.26, 0.29, 0.31, 0.49, 0.52, 1.95, 2.15)]
#: These waits are enough while a message is under way.
UNDER_WAY = (0.31, 2.15)


class Unheard(Wrong):
    """A person asks in vain."""


def sleeping(name, number):
    """A node does not run, for a time below and above each limit."""
    return [('{} is stopped for {} s, then hears {} first'.format(name, seconds, first), 'sleep', number, seconds,
             first == 'sensors') for seconds in (0.95, 1.1, 1.95, 2.15) for first in ('requests', 'sensors')]


def held_up(name, node, sender):
    return [('the network holds up {} for {} s'.format(name, seconds), 'hold_up', node, sender, seconds)
            for seconds in (0.45, 1.95, 2.15)]


SWITCHING = [
    ('0.31 s pass', 'let_pass', 0.31), ('2.15 s pass', 'let_pass', 2.15), ('20.2 s pass', 'let_pass', 20.2),
    ('the robot is switched on', 'switch', True), ('the robot is switched on while it is carried', 'switch', True, 0.5),
    ('the robot is switched off', 'switch', False),
    ('the robot is off for 2.15 s, in which a setting is changed', 'go_and_come')]


class World:
    """move_to_goal, persons at terminals, a program that repeats a goal, a student's gamepad that latches, and `PADS`
    gamepads."""

    PADS = 0
    #: Is a robot there when the nodes start? Does it send its wheels?
    ROBOT_IS_ON, SENDS_WHEELS = True, False
    EVENTS = WAITING + sleeping('move_to_goal', 0) + [
        ('a goal is sent', 'goal'), ('a program begins to repeat a goal', 'repeat_goal', True),
        ('the program ends', 'repeat_goal', False), ('every goal is cancelled', 'cancel'),
        ('the pose is reset', 'reset'),
        ('move_to_goal is killed and started', 'start_mover', False),
        ('move_to_goal is killed and started with control', 'start_mover', True),
        ('a new terminal says True', 'by_terminal', True, True), ('a terminal says False', 'by_terminal', False, True),
        ('the same terminal says True', 'by_terminal', True, False),
        ('rostopic pub -r begins to say True, or ends', 'repeat'),
        ('the student says True', 'student', True), ('the student says False', 'student', False)]

    def __init__(self):
        self.now = 1e5
        # It stands. `new_at`: the end of its last long silence. If it was carried then, its gyro is wrong [rad/s].
        self.robot = SimpleNamespace(is_on=self.ROBOT_IS_ON, sends_wheels=self.SENDS_WHEELS,
                                     off_at=self.now, new_at=self.now, gyro_error=0.0)
        self.drives = False          # did the robot move in the last event?
        self.nodes, self.pads = [], []
        self.mover, self.repeats_goal, self.due_at = None, False, self.now
        self.senders, self.words = {'student': SenderConnection('student', is_latched=True)}, {}
        self.processes, self.terminal, self.repeater = 0, None, None    # how many, and two names
        self.start_mover(False)
        for number in range(self.PADS):
            self.add_pad(number)
        self.wait(4.6)

    def wait(self, seconds):
        while seconds > 1e-9:
            step = min(seconds, TICK)
            seconds -= step
            self.now += step
            self.passed()
            for node in self.nodes:
                node.check_clock()
            for node in self.nodes:
                if node.asleep_since is None and not node.is_dead:
                    node.tick()

    def judge(self, command, rule):
        if command is not None and command != Twist2():
            robot, objection = self.robot, rule.objection(self.now)
            new_at = max(robot.new_at, self.nodes[0].born_at)
            if robot.sends_wheels and isinstance(rule, GoalRule) and (
                    robot.gyro_error or self.now - new_at < COMPARED):
                objection = objection or 'its gyro was not compared with the wheels, or is wrong'
            if objection:
                raise Wrong(objection)
            self.drives = True

    def is_obeyed(self, seconds, by):
        """Unheard is raised if the robot does not move within `seconds` after a person asked for it."""
        self.drives = False
        self.wait(seconds)
        if not self.drives:
            raise Unheard('a person asks anew in vain, by ' + by)

    def start_mover(self, has_control):
        self.mover = Mover(self, has_control)
        self.nodes = [self.mover] + self.pads

    def start_sender(self, name, **how):
        """A new process, which is connected at once. The messages of a process with its name are lost."""
        self.processes += 1
        self.senders[name] = SenderConnection(name, str(self.processes), **how)
        self.words.pop(name, None)
        self.mover.connect([name])

    def rostopic(self, ended):
        """A new process, in place of one that ended. It has a new name, which is returned."""
        self.senders.pop(ended, None)
        name = 'rostopic {}'.format(self.processes)
        self.start_sender(name)
        return name

    def tell(self, name, word, at):
        """A word on ctrl_relinq."""
        self.words[name] = word
        self.mover.send(name, 'on_ctrl_relinq', self.mover.ways[name], word, at)
        for pad in self.pads:
            if pad.name != name and not word:
                pad.send('others', 'on_taken')

    def passed(self):
        if self.repeats_goal and self.now >= self.due_at + PERIOD - 1e-6:
            self.due_at = self.now
            self.mover.send('program', 'on_goal', 'program', None)
        if self.repeater:
            self.tell(self.repeater, True, None)
        for pad in self.pads:
            pad.show()

    # -- events

    def switch(self, is_on, gyro_error=0.0):
        """A board that was off for long has calibrated its gyro again."""
        robot = self.robot
        if robot.is_on is is_on:
            return NOTHING
        robot.is_on = is_on
        if not is_on:
            robot.off_at = self.now
        elif self.now - robot.off_at > OVER:
            robot.new_at, robot.gyro_error = self.now, gyro_error

    def go_and_come(self):
        if self.switch(False) is NOTHING:
            return NOTHING
        self.wait(1.9)
        self.nodes[0].core.set_law(Ahead())
        self.wait(0.25)
        self.switch(True)

    def sleep(self, number, seconds, backwards):
        node = self.nodes[number]
        if node.asleep_since is not None:
            return NOTHING
        node.asleep_since, node.asleep_until, node.backwards = self.now, self.now + seconds, backwards

    def hold_up(self, node, sender, seconds):
        """The network holds up the messages of `sender` to a node."""
        if self.nodes[node].held:
            return NOTHING
        self.nodes[node].held[sender] = self.now + seconds

    def let_pass(self, seconds):
        if seconds not in UNDER_WAY and any(node.waiting or node.held or node.asleep_since for node in self.nodes):
            return NOTHING
        self.wait(seconds)

    def student(self, word):
        """The first True or False of all looks like a latched one in the moment of a start."""
        if 'student' not in self.words and self.now - self.mover.born_at < MAX_TRANSIT_TIME:
            return NOTHING
        self.tell('student', word, self.now)

    def by_terminal(self, word, is_new):
        """rostopic pub, in a new process or in one that sent something before."""
        if is_new:
            self.terminal = self.rostopic(self.terminal)
        elif not self.terminal:
            return NOTHING
        self.tell(self.terminal, word, self.now)

    def repeat(self):
        if self.repeater:
            del self.senders[self.repeater]
            self.repeater = None
        else:
            self.repeater = self.rostopic(None)
            self.tell(self.repeater, True, self.now)

    def goal(self):
        self.mover.send('goals', 'on_goal', 'person', self.now)

    def repeat_goal(self, on):
        """A program begins, which is heard at once, or ends."""
        if self.repeats_goal is on or on and self.mover.asleep_since is not None:
            return NOTHING
        self.repeats_goal, self.due_at = on, self.now
        if on:
            self.mover.send('program', 'on_goal', 'program', self.now)
            self.wait(PERIOD + 0.01)

    def cancel(self):
        self.mover.send('cancels', 'on_cancel', self.now)

    def reset(self):
        self.mover.send('resets', 'on_reset', self.now)

    def press(self, number, button):
        """Press a button for a moment."""
        pad = self.pads[number]
        if pad.is_dead or not pad.plugged:
            return NOTHING
        for pad.button in (button, None):
            pad.show()
            self.wait(0.06)

    def change(self, number, what, value):
        """The stick, the plug or the clock of a pad."""
        pad = self.pads[number]
        if getattr(pad, what) == value:
            return NOTHING
        setattr(pad, what, value)
        pad.show()

    def add_pad(self, number):
        """A gamepad node starts, in place of the one before. It hears what is latched."""
        name = 'pad {}'.format(number)
        self.mover.waiting.pop(name, None)
        self.start_sender(name, is_latched=True, has_renewals=True)
        self.pads[number:number + 1] = [PadNode(self, name)]
        self.nodes = [self.mover] + self.pads
        if self.mover.has_control is not None:
            self.pads[number].on_control(self.mover.has_control)
        if any(sender.is_latched and self.words.get(name) is False for name, sender in self.senders.items()):
            self.pads[number].on_taken()

    def end_pad(self, number):
        if self.pads[number].is_dead:
            return NOTHING
        self.pads[number].is_dead = True

    def ask_anew(self):
        """A person asks for motion in each way; Unheard if nothing moves."""
        self.repeat_goal(False)
        for number, pad in enumerate(self.pads):
            if pad.is_dead:
                self.add_pad(number)
            pad = self.pads[number]
            pad.plugged, pad.stick, pad.button = True, 0.0, None
        self.robot.is_on, self.robot.gyro_error = True, 0.0
        # all nodes wake and connect, their messages arrive, and a sender's goal is no repetition
        self.wait(5.0)
        self.goal()
        for word in (False, True):
            self.by_terminal(word, True)
        self.is_obeyed(0.3, 'a terminal')
        for number in range(26):    # 125 times a second, as the handout's gamepad
            self.student(number > 0)
            self.wait(0.008)
        self.is_obeyed(0.1, 'a sender that says True without a pause')
        for number, pad in enumerate(self.pads):
            self.by_terminal(False, True)
            self.wait(0.5)
            self.change(number, 'stick', 1.0)
            self.is_obeyed(0.3, 'the stick of ' + pad.name)
            self.change(number, 'stick', 0.0)
            self.press(number, 0)
            self.is_obeyed(0.3, 'A of ' + pad.name)


def of_pad(number):
    name = 'pad {}'.format(number)
    return held_up('gamepad ' + name, 0, name) + held_up(name, 1 + number, 'joy') + [
        ('{} of {}'.format(letter, name), 'press', number, button) for button, letter in enumerate('ABY')] + [
        ('the {} of {} is {}'.format(what, name, value), 'change', number, what, value) for what, value in (
            ('stick', 1.0), ('stick', 0.0), ('plugged', False), ('plugged', True), ('clock', CLOCK - 0.4))] + [
        ('the node of {} dies'.format(name), 'end_pad', number),
        ('the node of {} starts'.format(name), 'add_pad', number)]


class OnePad(World):
    PADS = 1
    EVENTS = World.EVENTS + of_pad(0) + sleeping('gamepad', 1)


class TwoPads(World):
    PADS = 2
    EVENTS = World.EVENTS + of_pad(0) + of_pad(1)


class GoneRobot(OnePad):
    """The robot may disappear, and return."""

    SENDS_WHEELS = True
    EVENTS = SWITCHING + OnePad.EVENTS[len(WAITING):]


class LateRobot(GoneRobot):
    ROBOT_IS_ON = False
