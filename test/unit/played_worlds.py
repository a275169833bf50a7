"""The worlds of stories: nodes, persons, a network, and the events that can happen.

An event is (words for a story, name of a method, its arguments). Units: seconds.
"""
from types import SimpleNamespace

from oracle import COMPARED, OVER, GoalOracle
from played_nodes import CLOCK, TICK, Ahead, Mover, Pad, Sender, Turner, Turning, Wrong
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.freshness import LATCHED_WITHIN

#: Stories begin at this time; so only the numbers above half of it are times.
BEGIN = 1e5
#: Times longer ago than this make no difference.
LONG_AGO = 2.3
#: Just below and above each limit: 0.04 (confirmation), 0.2 to 0.3 (pad, mouse, waking, crossing),
#: 0.5 (lapse), 2.0 (longest lapse).
WAITS = (0.03, 0.06, 0.24, 0.26, 0.29, 0.31, 0.49, 0.52, 1.95, 2.15)
WAITS_UNDER_WAY = (0.31, 2.15)
#: Lengths of a process's sleep, and of a stall of the network.
SLEEPS = (0.95, 1.1, 1.95, 2.15)
HELD_UP = (0.45, 1.95, 2.15)


#: The answer of an event that is impossible.
NOTHING = object()


class Unheard(Wrong):
    """A person asks in vain."""


class World:
    """Nodes and persons. `EVENTS`: (words of a story, method, arguments)."""

    EVENTS = ()

    #: Has a robot been there for long? Does it send its wheels?
    ROBOT_IS_ON, SENDS_WHEELS = True, False

    def __init__(self):
        self.now = BEGIN
        # It stands. `new_at`: the end of its last long silence. If it was carried then, its gyro is
        # wrong [rad/s].
        self.robot = SimpleNamespace(is_on=self.ROBOT_IS_ON, sends_wheels=self.SENDS_WHEELS,
                                     off_at=self.now, new_at=self.now, gyro_error=0.0)
        self.drives = False          # did the robot move in the last event?
        self.nodes = []
        self.pads = []

    def wait(self, seconds):
        while seconds > 1e-9:
            step = min(seconds, TICK)
            seconds -= step
            self.now += step
            self.passed()
            for node in self.nodes:
                node.look_at_clock()
            for node in self.nodes:
                node.tick()

    def passed(self):
        """A moment has passed."""

    def judge(self, command, oracle):
        if command is not None and command != Twist2():
            robot, objection = self.robot, oracle.objection(self.now)
            new_at = max(robot.new_at, self.nodes[0].born_at)
            if robot.sends_wheels and isinstance(oracle, GoalOracle) and (
                    robot.gyro_error or self.now - new_at < COMPARED):
                objection = objection or 'its gyro was not compared with the wheels, or is wrong'
            if objection:
                raise Wrong(objection)
            self.drives = True

    def calm(self):
        """Everybody is awake and there, and heard for a while."""
        self.robot.is_on, self.robot.gyro_error = True, 0.0
        self.wait(5.0)

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
        self.nodes[0].core.set_law(Turning() if isinstance(self.nodes[0], Turner) else Ahead())
        self.wait(0.25)
        self.switch(True)

    def is_obeyed(self, seconds, by):
        """Unheard is raised if the robot does not move within `seconds` after a person asked for it."""
        self.drives = False
        self.wait(seconds)
        if not self.drives:
            raise Unheard('a person asks anew in vain, by ' + by)

    def sleep(self, number, seconds, backwards):
        """A node does not run for so long."""
        node = self.nodes[number]
        if node.asleep_since is not None:
            return NOTHING
        node.asleep_since, node.asleep_until = self.now, self.now + seconds
        node.backwards = backwards

    def hold_up(self, node, sender, seconds):
        """The network holds up the messages of `sender` to a node for so long."""
        if self.nodes[node].held:
            return NOTHING
        self.nodes[node].held[sender] = self.now + seconds

    def let_pass(self, seconds):
        if seconds not in WAITS_UNDER_WAY and not self.is_quiet:
            return NOTHING
        self.wait(seconds)

    @property
    def actors(self):
        """All objects whose state decides what comes."""
        return self.nodes

    @property
    def is_quiet(self):
        """Is no message under way?"""
        return not any(node.waiting or node.held or node.asleep_since for node in self.nodes)


class Program:
    """Sends a goal again and again while it runs."""

    PERIOD = 0.3

    def __init__(self):
        self.repeats, self.due_at = False, BEGIN

    def pass_to(self, world):
        if self.repeats and world.now >= self.due_at + self.PERIOD - 1e-6:
            self.due_at = world.now
            world.mover.send('program', 'on_goal', 'program', None)


class Labs(World):
    """move_to_goal, a student's gamepad that latches, a terminal; with `pads` gamepads."""

    PADS = 0

    def __init__(self):
        super().__init__()
        self.mover, self.program = None, Program()
        self.senders = {'student': Sender(latches=True)}
        self.start_mover(False)
        for number in range(self.PADS):
            self.add_pad(number)
        self.wait(2.0 * LONG_AGO)

    @property
    def actors(self):
        return self.nodes + [self.senders, self.program]

    def start_mover(self, has_control, connects_after=0.0):
        self.mover = Mover(self, has_control, connects_after)
        self.nodes = [self.mover] + self.pads

    def start_sender(self, name, **how):
        """A new process, which is connected at once. The messages of the process before it are lost."""
        way = self.mover.ways.get(name)
        self.senders[name] = Sender('b' if way and way.process == 'a' else 'a', **how)
        if not self.mover.connects_at or name not in self.mover.origins._present:
            self.mover.connect([name])

    def tell(self, name, word, at):
        """A word on ctrl_relinq."""
        self.senders[name].word = word
        if name in self.mover.ways:
            self.mover.send(name, 'on_word', self.mover.ways[name], word, at)
        for pad in self.pads:
            if pad.name != name and not word:
                pad.send('others', 'on_taken')

    def student(self, word):
        """The first True or False of all looks like a latched one in the moment of a start."""
        is_first = self.senders['student'].word is None
        if is_first and self.now - self.mover.born_at < LATCHED_WITHIN:
            return NOTHING
        self.tell('student', word, self.now)

    def by_terminal(self, word, is_new, name='terminal'):
        """rostopic pub, in a new process or in one that sent something before."""
        if is_new:
            self.mover.forget(name)
            self.start_sender(name)
        elif name not in self.senders:
            return NOTHING
        self.tell(name, word, self.now)

    def repeat(self):
        """rostopic pub -r sends True, and repeats it until it is ended; see :meth:`passed`."""
        if 'repeater' in self.senders:
            del self.senders['repeater']
            return
        self.by_terminal(True, True, 'repeater')

    def passed(self):
        """A moment has passed."""
        self.program.pass_to(self)
        if 'repeater' in self.senders:
            self.tell('repeater', True, None)

    def goal(self):
        """A person sends a goal."""
        self.mover.send('goals', 'on_goal', 'person', self.now)

    def repeat_goal(self, on):
        """A person starts a program that sends one goal again and again, or ends it."""
        program = self.program
        if program.repeats is on:
            return NOTHING
        program.repeats, program.due_at = on, self.now
        if on:
            self.mover.send('program', 'on_goal', 'program', self.now)
            self.wait(program.PERIOD + 0.01)

    def cancel(self, after=0.0):
        self.wait(after)
        self.mover.send('cancels', 'on_cancel', self.now)

    def reset(self):
        self.mover.send('resets', 'on_reset', self.now)

    def press(self, number, button):
        """A short press."""
        pad = self.pads[number]
        if pad.is_dead or not pad.plugged:
            return NOTHING
        for pad.button in (button, None):
            pad.show()
            self.wait(0.06)

    def push(self, number, stick):
        pad = self.pads[number]
        if pad.stick == stick:
            return NOTHING
        pad.stick = stick
        pad.show()

    def set_back(self, number):
        pad = self.pads[number]
        if pad.clock != CLOCK:
            return NOTHING
        pad.clock -= 0.4

    def plug(self, number, plugged):
        pad = self.pads[number]
        if pad.plugged is plugged:
            return NOTHING
        pad.plugged = plugged

    def add_pad(self, number):
        """A gamepad node starts. It hears what is latched."""
        name = 'pad {}'.format(number)
        self.mover.waiting.pop(name, None)
        self.start_sender(name, latches=True, renews=True)
        self.pads[number:number + 1] = [Pad(self, name)]
        self.nodes = [self.mover] + self.pads
        if self.mover.has_control is not None:
            self.pads[number].on_control(self.mover.has_control)
        if any(sender.latches and sender.word is False for sender in self.senders.values()):
            self.pads[number].on_taken()

    def end_pad(self, number):
        """Its node has died."""
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
        self.calm()
        self.goal()
        for word in (False, True):
            self.by_terminal(word, True)
        self.is_obeyed(0.3, 'a terminal')
        for rate, times in ((125, 50), (30, 45)):
            for number in range(times):    # as the handout's gamepad and rostopic -r do
                self.student(number > 0)
                self.wait(1.0 / rate)
            self.is_obeyed(0.1, 'a sender that says True {} times a second'.format(rate))
        for number, pad in enumerate(self.pads):
            self.by_terminal(False, True)
            self.wait(0.5)
            self.push(number, 1.0)
            self.is_obeyed(0.3, 'the stick of ' + pad.name)
            self.push(number, 0.0)
            self.press(number, 0)
            self.is_obeyed(0.3, 'A of ' + pad.name)


def sleeping(name, number):
    return [('{} is stopped for {} s{}'.format(name, seconds, ', then its threads run in another order'
                                               * backwards), 'sleep', number, seconds, backwards)
            for seconds in SLEEPS for backwards in (False, True)]


def held_up(name, node, sender):
    return [('the network holds up {} for {} s'.format(name, seconds), 'hold_up', node, sender, seconds)
            for seconds in HELD_UP]


WAITING = [('{:.2f} s pass'.format(seconds), 'let_pass', seconds) for seconds in WAITS]
PASSING = [event for event in WAITING if event[2] > 0.26]    # without the limits of a pad
MOVER = sleeping('move_to_goal', 0) + [
    ('a goal is sent', 'goal'), ('every goal is cancelled', 'cancel'), ('the pose is reset', 'reset'),
    ('move_to_goal is killed and started', 'start_mover', False),
    ('a new terminal says True', 'by_terminal', True, True),
    ('a terminal says False', 'by_terminal', False, True)]


class Senders(Labs):
    """Persons at terminals, and a student's gamepad with a latched topic."""

    EVENTS = PASSING + MOVER + [
        ('move_to_goal is killed and started with control', 'start_mover', True),
        ('the same terminal says True', 'by_terminal', True, False),
        ('rostopic pub -r begins to say True, or ends', 'repeat'),
        ('move_to_goal is killed and started, and connects late', 'start_mover', False, 1.95),
        ('it is started with control, and connects late', 'start_mover', True, 1.95),
        ('the student says True', 'student', True), ('the student says False', 'student', False)]


class OnePad(Labs):
    """The same with a gamepad."""

    PADS = 1
    EVENTS = WAITING + MOVER + sleeping('gamepad', 1) + [
        ('A', 'press', 0, 0), ('B', 'press', 0, 1), ('Y', 'press', 0, 2),
        ('the stick is pushed', 'push', 0, 1.0), ('the stick is let go', 'push', 0, 0.0),
        ('the pad is pulled out', 'plug', 0, False), ('the pad is plugged in', 'plug', 0, True),
        ('gamepad dies', 'end_pad', 0), ('gamepad is started anew', 'add_pad', 0),
        ('the clock of the pad is set back', 'set_back', 0)] + held_up(
            'the gamepad', 0, 'pad 0') + held_up('the pad', 1, 'joy')


class LatePad(OnePad):
    """The same behind a network that holds messages up, without sleeps and restarts"""

    EVENTS = [event for event in OnePad.EVENTS
              if event[1] in ('press', 'push', 'plug', 'hold_up')
              or event[1] == 'let_pass' and event[2] in (0.31, 0.52, 2.15)]


class TwoPads(Labs):
    """Two gamepads on one move_to_goal."""

    PADS = 2
    EVENTS = WAITING + sleeping('move_to_goal', 0) + [
        event for number in (0, 1) for event in [
            ('A of pad {}'.format(number), 'press', number, 0),
            ('B of pad {}'.format(number), 'press', number, 1),
            ('pad {} is pulled out'.format(number), 'plug', number, False),
            ('pad {} is plugged in'.format(number), 'plug', number, True)] + held_up(
                'gamepad {}'.format(number), 0, 'pad {}'.format(number))]


class Goals(Labs):
    """Goals of a person and of a program that repeats one, and cancels."""

    EVENTS = PASSING + sleeping('move_to_goal', 0) + [
        ('a goal is sent', 'goal'), ('a program begins to repeat a goal', 'repeat_goal', True),
        ('the program ends', 'repeat_goal', False), ('every goal is cancelled', 'cancel', 0.31),
        ('the pose is reset', 'reset'),
        ('a new terminal says True', 'by_terminal', True, True),
        ('a terminal says False', 'by_terminal', False, True)]


SWITCHING = [('{:.2f} s pass'.format(seconds), 'let_pass', seconds)
             for seconds in (0.31, 1.95, 2.15, 20.2)] + [
    ('the robot is switched on', 'switch', True),
    ('the robot is switched on while it is carried', 'switch', True, 0.5),
    ('the robot is switched off', 'switch', False),
    ('the robot is off for 2.15 s, in which a setting is changed', 'go_and_come')]


class LateRobot(Labs):
    """A robot that comes late, goes, and comes again; with a gamepad."""

    PADS, ROBOT_IS_ON, SENDS_WHEELS = 1, False, True
    EVENTS = SWITCHING + [event for event in Senders.EVENTS + OnePad.EVENTS
                          if event[1] in ('start_mover', 'goal', 'press')] + [
        ('a new terminal says True', 'by_terminal', True, True)]


class GoneRobot(LateRobot):
    """The same; the robot is there at first, and a program may repeat a goal."""

    ROBOT_IS_ON = True
    EVENTS = LateRobot.EVENTS + [('a program begins to repeat a goal', 'repeat_goal', True)]


def mouse(name, edge):
    return [('the {} {}'.format(name, words), 'set', name, what, value) for words, what, value in [
        ('is activated', 0, True), ('is deactivated', 0, False), ('moves to the edge', 1, edge),
        ('moves to the middle', 1, 0.0)]]


class MouseAndTurns(World):
    """controller, a mouse, and persons who ask for turns."""

    EDGES = {'mouse': 1.0}       # by the names of the mice
    EVENTS = WAITING + sleeping('controller', 0) + mouse('mouse', 1.0) + [
        ('a turn is asked for', 'turn'),
        ('rostopic pub -r begins to ask for turns, or ends', 'repeat'),
        ('controller is killed and started', 'start')] + held_up('the mouse', 0, 'mouse')

    def __init__(self):
        super().__init__()
        self.repeats = False
        self.hands = {name: [False, 0.0] for name in self.EDGES}    # active, y
        self.start()
        self.wait(2.0 * LONG_AGO)

    def start(self):
        self.nodes = [Turner(self)]
        for name in self.hands:
            self.show(name)          # its topic is latched

    def turn(self):
        self.nodes[0].send('turns', 'on_turn', self.now)

    def repeat(self):
        self.repeats = not self.repeats
        if self.repeats:
            self.nodes[0].forget_script()
            for at in (self.now, None):     # a repetition is known by its second message
                self.nodes[0].send('script', 'on_turn', at, 'script')

    def set(self, name, what, value):
        if self.hands[name][what] == value:
            return NOTHING
        self.hands[name][what] = value
        self.show(name)

    def ask_anew(self):
        for name in self.hands:
            self.set(name, 0, False)
        self.calm()
        self.turn()
        self.is_obeyed(0.3, 'a turn')
        for name, edge in self.EDGES.items():
            self.hands[name][:] = True, edge
            self.is_obeyed(0.3, 'the ' + name)
            self.set(name, 0, False)
            self.wait(0.5)

    def show(self, name):
        self.nodes[0].send(name, 'on_mouse', name, *self.hands[name], self.now)

    def passed(self):
        """An active mouse repeats itself, and a script its turn."""
        if self.repeats:
            self.nodes[0].send('script', 'on_turn', None, 'script')
        for name, (active, _) in self.hands.items():
            if active:
                self.show(name)


class TwoMice(MouseAndTurns):
    """Two mice, also one that is moved while it is not active."""

    EDGES = {'mouse': 1.0, 'page': -1.0}
    EVENTS = [event for event in WAITING + sleeping('controller', 0)
              if event[-1] in (0.24, 0.31, 2.15) or event[-2] == 1.1] + (
                  mouse('mouse', 1.0) + mouse('page', -1.0))


class LateTurns(MouseAndTurns):
    """A robot that comes late, and turns."""

    ROBOT_IS_ON, SENDS_WHEELS = False, True
    EVENTS = SWITCHING + [('a turn is asked for', 'turn'),
                          ('controller is killed and started', 'start')]
