"""The worlds of stories: nodes, persons, a network, and the events that can happen.

An event is (words for a story, name of a method, its arguments). Units: seconds.
"""
from played_nodes import CLOCK, TICK, Mover, Pad, Turner
from tb3_labs.control.speed_laws import Twist2

#: Stories begin then; so a number above half of it is a time, and no other number is.
BEGIN = 1e5
#: Times longer ago than this are all the same.
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


class Wrong(Exception):
    """A command against the rule."""


class Unheard(Wrong):
    """A person asks in vain."""


class World:
    """Nodes and persons. `EVENTS`: (words of a story, method, arguments)."""

    EVENTS = ()

    def __init__(self):
        self.now = BEGIN
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
            objection = oracle.objection(self.now)
            if objection:
                raise Wrong(objection)
            self.drives = True

    def calm(self):
        """Everybody is awake and there, and heard for a while."""
        self.wait(8.0)

    def is_obeyed(self, seconds, by):
        """Unheard if the robot does not move within `seconds` after a person asked for it."""
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
        """Everything whose state makes a difference."""
        return self.nodes

    @property
    def is_quiet(self):
        """Is no message under way?"""
        return not any(node.waiting or node.held or node.asleep_since for node in self.nodes)


class Labs(World):
    """move_to_goal, a student's gamepad that latches, a terminal; with `pads` gamepads."""

    PADS = 0

    def __init__(self):
        super().__init__()
        self.mover = None
        self.latched = {'student': None}
        self.start_mover(False)
        self.pads = [Pad(self, 'pad {}'.format(number)) for number in range(self.PADS)]
        self.nodes += self.pads
        self.wait(2.0 * LONG_AGO)

    def start_mover(self, has_control):
        # A terminal that repeats True by itself gives control to a node that is started meanwhile: it
        # cannot be told from one in which a person types (doc/instructor/failures.md).
        self.latched.pop('terminal', None)
        self.mover = Mover(self, sorted(self.latched.items()), has_control)
        self.nodes = [self.mover] + self.pads

    def tell(self, sender, word, renews, at):
        """A word on ctrl_relinq."""
        self.mover.send(sender, 'on_word', sender, word, renews, at)
        for pad in self.pads:
            if pad.name != sender and not word:
                pad.send('others', 'on_taken')
        self.latched[sender] = word

    def student(self, word):
        self.tell('student', word, False, self.now)

    def repeat(self):
        """rostopic pub -r goes on: nobody says anything."""
        if 'terminal' not in self.latched:
            return NOTHING
        self.tell('terminal', self.latched['terminal'], False, None)

    def by_terminal(self, word, is_new):
        """rostopic pub, in a new process or in one that said something before."""
        if is_new:
            self.mover.core._permission._said.pop('terminal', None)
        self.tell('terminal', word, False, self.now)

    def goal(self):
        self.mover.send('goals', 'on_goal', self.now)

    def cancel(self):
        self.mover.send('cancels', 'on_cancel', self.now)

    def reset(self):
        self.mover.send('resets', 'on_reset')

    def press(self, number, button):
        """A short press."""
        pad = self.pads[number]
        if not pad.plugged:
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

    def start_pad(self, number):
        """The old node has died: its messages under way are lost."""
        name = self.pads[number].name
        self.mover.waiting.pop(name, None)
        self.pads[number] = Pad(self, name)
        self.nodes[1 + number] = self.pads[number]


    def ask_anew(self):
        """A person asks for motion in each way; Unheard if nothing moves."""
        for pad in self.pads:
            pad.plugged, pad.stick, pad.button = True, 0.0, None
        self.calm()
        self.goal()
        for word in (False, True):
            self.by_terminal(word, True)
        self.is_obeyed(0.3, 'a terminal')
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
    """Persons at terminals, and a student's gamepad that latches."""

    EVENTS = PASSING + MOVER + [
        ('move_to_goal is killed and started with control', 'start_mover', True),
        ('the same terminal says True', 'by_terminal', True, False),
        ('the terminal repeats its word', 'repeat'),
        ('the student says True', 'student', True), ('the student says False', 'student', False)]


class OnePad(Labs):
    """The same with a gamepad."""

    PADS = 1
    EVENTS = WAITING + MOVER + sleeping('gamepad', 1) + [
        ('A', 'press', 0, 0), ('B', 'press', 0, 1),
        ('the stick is pushed', 'push', 0, 1.0), ('the stick is let go', 'push', 0, 0.0),
        ('the pad is pulled out', 'plug', 0, False), ('the pad is plugged in', 'plug', 0, True),
        ('gamepad is killed and started', 'start_pad', 0),
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


class MouseAndTurns(World):
    """controller, a mouse, and persons who ask for turns."""

    EVENTS = WAITING + sleeping('controller', 0) + [
        ('a turn is asked for', 'turn'),
        ('the mouse is activated', 'activate', True), ('the mouse is deactivated', 'activate', False),
        ('the mouse moves to the edge', 'move', 1.0), ('the mouse moves to the middle', 'move', 0.0),
        ('controller is killed and started', 'start')] + held_up('the mouse', 0, 'mouse')

    def __init__(self):
        super().__init__()
        self.active, self.y = False, 0.0
        self.start()
        self.wait(2.0 * LONG_AGO)

    def start(self):
        self.nodes = [Turner(self)]
        self.show()                  # the mouse's topic is latched

    def turn(self):
        self.nodes[0].send('turns', 'on_turn', self.now)

    def activate(self, active):
        if self.active is active:
            return NOTHING
        self.active = active
        self.show()

    def move(self, y):
        if self.y == y:
            return NOTHING
        self.y = y
        self.show()

    def ask_anew(self):
        self.active = False
        self.show()
        self.calm()
        self.turn()
        self.is_obeyed(0.3, 'a turn')
        self.active, self.y = True, 1.0
        self.is_obeyed(0.3, 'the mouse')

    def show(self):
        self.nodes[0].send('mouse', 'on_mouse', self.active, self.y, self.now)

    def passed(self):
        """An active mouse repeats itself."""
        if self.active:
            self.show()
