"""Did a person permit each command? Random stories of stops and givings, judged by a ledger.

A story is a random sequence of events in some seconds: two pads, words of persons on `ctrl_relinq`,
goals, cancels, resets; pads that are unplugged, nodes that are killed, started again or put to
sleep, links that delay messages, a clock that is set. The cores of both nodes run it. Then the
judge decides for each command whether a person had permitted it.

    python3 test/unit/ledger.py [number of stories, default 10000] [first seed]

Units: seconds.
"""
import random
import sys
from collections import deque
from concurrent.futures import ProcessPoolExecutor

from judge import PADS, judge, judge_sticks
from tb3_labs.control.speed_laws import LawStep, Twist2
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.gamepad import GamepadCore
from tb3_labs.nodes.move_to_goal import MoveToGoalCore
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import robot_model

STEP = 0.02
#: A pad repeats its state, and a gamepad its permission, with these periods.
JOY_PERIOD, RENEWAL_PERIOD = 0.05, 0.1
A, B = 0, 1


class Link:
    """A stream of messages from one node to another: in order, late, sometimes stalled."""

    def __init__(self, deliver, delay=0.005):
        self._deliver, self._delay = deliver, delay
        self._under_way = deque()
        self.held_until = 0.0

    def send(self, now, *message):
        self._under_way.append((now + self._delay, message))

    def run(self, now):
        while self._under_way and now >= max(self._under_way[0][0], self.held_until):
            self._deliver(now, *self._under_way.popleft()[1])

    def cut(self):
        """The node at its end has died: messages under way are lost."""
        self._under_way.clear()


class Ahead:
    """A law that never finishes."""

    period = 1.0 / 30.0
    distance_tolerance = 0.01

    def __init__(self):
        self._left = 1e6

    def start(self, pose, goal):
        pass

    def resume(self, state, pose, goal):
        return state

    def shortfall(self, pose, goal):
        return ''

    def rotate_to_goal(self, motion, goal, dt):
        self._left -= 0.1
        return LawStep(Twist2(0.1, 0.2), self._left, False)

    move_forward = rotate_to_final = rotate_to_goal


class PadNode:
    """A gamepad node and its pad; after a kill and a start it is a new node."""

    def __init__(self, name, world):
        self.name, self.world = name, world
        self.plugged, self.buttons, self.stick = True, set(), 0.0
        self.joy = Link(self._on_joy)
        self.to_mover = Link(world.on_word)
        self.from_mover = Link(lambda now, word: self.alive and self.core.on_control(word, now))
        self.from_others = Link(lambda now: self.alive and self.core.on_taken(now))
        self.asleep_until = 0.0
        self.start(0.0)

    def start(self, now):
        self.core = GamepadCore(PadConfig(), robot_model('burger'))
        self.alive, self.said_at, self.latched = True, -1.0, False
        self.next_joy, self.moves = now, False
        for word in self.core.take_words():
            self.say(now, word, 'started', now)

    def kill(self):
        self.alive = self.moves = False
        for link in (self.joy, self.to_mover, self.from_mover, self.from_others):
            link.cut()

    def _on_joy(self, now, axes, buttons, sent_at):
        if self.alive:
            self.core.on_joy(axes, buttons, now, sent_at + 77.0)
            self.say_words(now, 'pressed', sent_at)

    def send_joy(self, now):
        axes, buttons = [0.0] * 4, [0] * 4
        axes[1] = self.stick
        for button in self.buttons:
            buttons[button] = 1
        if self.plugged and self.alive:
            self.joy.send(now, axes, buttons, now)

    def run(self, now):
        if now >= self.next_joy:
            self.next_joy = now + JOY_PERIOD
            self.send_joy(now)
        if now < self.asleep_until:
            self.moves = False
            return
        if self.alive:
            self.core.update(now)
        for link in (self.joy, self.from_mover, self.from_others):
            link.run(now)
        if not self.alive:
            return
        if self.core.due(now):
            command = self.core.command(now)
            self.moves = command is not None and command != Twist2()
        self.say_words(now, 'of itself', now)
        if self.core.gives and now - self.said_at >= RENEWAL_PERIOD:
            self.say(now, True, 'renewal', now)
        self.core.take_news()

    def say_words(self, now, why, caused_at):
        for word in self.core.take_words():
            self.say(now, word, why, caused_at)

    def say(self, now, word, why, caused_at):
        self.said_at, self.latched = now, word
        self.to_mover.send(now, self.name, word, True, why, caused_at)
        for other in self.world.pads.values():
            if other is not self and not word:
                other.from_others.send(now)


class World:
    """The nodes, the robot, and a history of the actions of persons and of the commands."""

    def __init__(self, seed):
        self.chance = random.Random(seed)
        self.now, self.ros_ahead = 0.0, 1000.0
        self.pads = {}
        self.pads = {name: PadNode(name, self) for name in PADS}
        self.hands = Link(self.on_word, delay=0.01)
        self.sensors = Link(self._on_sample)
        self.x, self.speed, self.tremble = 0.0, 0.0, 1e-6
        self.hand_number = 0
        self.asleep_until = 0.0
        self.last_heard = {}
        self.history = []      # (time, what, details...)
        self.start_mover()

    # -- move_to_goal

    def start_mover(self):
        self.mover = MoveToGoalCore(Ahead())
        self.mover.set_goal(Pose2(50.0, 0.0, 0.0))
        self.has_control = None
        # its new connections bring the latched words of others, said before it started
        old = [pad.name for pad in self.pads.values() if pad.alive and pad.latched]
        self.note('mover started', old)
        for pad in self.pads.values():
            pad.to_mover.cut()
        for name in old:
            self.mover.told_control(True, self.now, name, True, True, True)

    def on_word(self, now, sender, word, renews, why, caused_at):
        if self.mover is None:
            return
        self.note('heard', sender, word, why, caused_at)
        self.mover.told_control(word, now, sender, renews)

    def _on_sample(self, _now, sample):
        if self.mover is None:
            return
        take = self.mover.on_imu if isinstance(sample, ImuSample) else self.mover.on_odometry
        take(sample, self.now + self.ros_ahead)
        self.mover.take_fix()
        self.mover.take_resets()

    def run_mover(self):
        if self.mover is None or self.now < self.asleep_until:
            return
        for pad in self.pads.values():
            pad.to_mover.run(self.now)
        self.hands.run(self.now)
        self.sensors.run(self.now)
        self.mover.update_control(self.now)
        ros_now = self.now + self.ros_ahead
        if self.mover.due(ros_now):
            command = self.mover.command(ros_now)
            self.speed = 0.0 if command is None else command.linear
            if self.speed:
                self.note('driven')
        elif not self.mover.has_control:
            self.speed = 0.0
        if self.mover.control_stands is not self.has_control:
            self.has_control = self.mover.control_stands
            for pad in self.pads.values():
                pad.from_mover.send(self.now, self.has_control)
        self.mover.take_news()

    # -- time

    def note(self, *what):
        self.history.append((self.now,) + what)

    def run(self, seconds):
        end = self.now + seconds
        while self.now < end:
            self.now += STEP
            self.tremble = -self.tremble
            self.x += self.speed * STEP
            stamp = self.now + 500.0
            self.sensors.send(self.now, ImuSample(stamp, self.tremble, self.tremble))
            self.sensors.send(self.now, OdometrySample(
                stamp, Pose2(self.x + self.tremble, 0.0, 0.0), self.speed, self.tremble))
            for pad in self.pads.values():
                pad.run(self.now)
                if pad.moves:
                    self.note('stick drives', pad.name)
                if pad.alive and pad.core.holder.value == 'move_to_goal':
                    self.note('lets move_to_goal drive', pad.name)
            self.run_mover()


# -- what happens

def press(world, button):
    """A short press of a button on a pad that is plugged in."""
    pad = world.pads[world.chance.choice(PADS)]
    if not (pad.plugged and pad.alive):
        return
    pad.buttons.add(button)
    pad.send_joy(world.now)
    world.run(world.chance.uniform(0.04, 0.15))
    pad.buttons.discard(button)
    pad.send_joy(world.now)


def hand(world):
    """rostopic pub -1 in a terminal: a new sender each time, or a sender that repeats its word."""
    world.hand_number += world.chance.random() < 0.7
    word = world.chance.random() < 0.5
    for _ in range(world.chance.choice((1, 1, 1, 5))):
        world.hands.send(world.now, 'hand %d' % world.hand_number, word, False, 'said', world.now)
        for pad in world.pads.values():
            if not word:
                pad.from_others.send(world.now)
        world.run(0.1)


def stick(world):
    pad = world.pads[world.chance.choice(PADS)]
    pad.stick = world.chance.choice((0.0, 0.0, 1.0))
    world.note('stick', pad.name, pad.stick)
    pad.send_joy(world.now)


def plug(world):
    pad = world.pads[world.chance.choice(PADS)]
    pad.plugged = not pad.plugged
    world.note('plugged' if pad.plugged else 'unplugged', pad.name)


def kill_pad(world):
    pad = world.pads[world.chance.choice(PADS)]
    if pad.alive:
        pad.kill()
    else:
        pad.start(world.now)
        world.note('pad started', pad.name)


def kill_mover(world):
    world.mover, world.speed = None, 0.0
    world.sensors.cut()
    world.hands.cut()
    world.run(world.chance.uniform(0.1, 1.5))
    world.start_mover()


def sleep_mover(world):
    """Ctrl+Z and fg."""
    seconds = world.chance.choice((0.5, 1.5, 3.0, 6.0))
    world.asleep_until = world.now + seconds
    world.speed = 0.0
    if world.mover is not None:
        world.note('mover sleeps', world.asleep_until)
    world.run(seconds)


def sleep_pad(world):
    pad = world.pads[world.chance.choice(PADS)]
    pad.asleep_until = world.now + world.chance.choice((0.5, 1.5, 3.0, 6.0))


def hold_link(world):
    """A stall of one link, or of all links to one node."""
    until = world.now + world.chance.choice((0.1, 0.3, 0.6, 1.2, 3.0, 6.0))
    pads = list(world.pads.values())
    links = world.chance.choice([
        [pad.joy for pad in pads], [pad.to_mover for pad in pads], [pads[0].joy],
        [pads[0].to_mover], [pads[1].from_mover, pads[1].from_others],
        [world.sensors], [pad.from_mover for pad in pads]])
    for link in links:
        link.held_until = until
    for pad in pads:
        if pad.joy in links:
            world.note('joy held', pad.name, until)


def goal(world):
    if world.mover is not None:
        try:
            world.mover.set_goal(Pose2(world.chance.uniform(20.0, 60.0), 0.0, 0.0))
        except ValueError:
            return
        world.note('goal')


def cancel(world):
    if world.mover is not None:
        world.mover.cancel()
        world.speed = 0.0
        world.note('cancelled')


def reset(world):
    if world.mover is not None:
        try:
            world.mover.reset(Pose2(), world.now + world.ros_ahead)
        except ValueError:
            return
        world.note('reset')


def set_clock(world):
    """NTP sets the clock of this computer; renewals use another clock."""
    world.ros_ahead += world.chance.choice((-5.0, -0.1, 0.05, 0.15))


ACTS = [(lambda world: press(world, A), 8), (lambda world: press(world, B), 6), (hand, 6),
        (stick, 4), (plug, 3), (kill_pad, 2), (kill_mover, 1), (sleep_mover, 1), (sleep_pad, 1),
        (hold_link, 5), (goal, 3), (cancel, 2), (reset, 2), (set_clock, 1)]


def story(seed, acts=25):
    """Play one; its history."""
    world = World(seed)
    kinds, weights = zip(*ACTS)
    world.run(0.5)
    for act in world.chance.choices(kinds, weights, k=acts):
        act(world)
        world.run(world.chance.choice((0.02, 0.1, 0.3, 0.7)))
    world.run(3.0)
    return world.history


# -- the judgement

def check(seed):
    """(seed, errors, number of commands)."""
    history = story(seed)
    return seed, judge(history) + judge_sticks(history), sum(entry[1] == 'driven' for entry in history)


if __name__ == '__main__':
    STORIES = int(sys.argv[1]) if len(sys.argv) > 1 else 10000
    FIRST = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    with ProcessPoolExecutor() as pool:
        RESULTS = list(pool.map(check, range(FIRST, FIRST + STORIES), chunksize=20))
    BAD = [(seed, wrong) for seed, wrong, _ in RESULTS if wrong]
    for SEED, WRONG in BAD[:10]:
        print('story {}: {} commands, the first after {:.2f} s: {}'.format(
            SEED, len(WRONG), *WRONG[0]))
    print('{} stories, {} commands to drive, {} stories with a command that nobody gave leave '
          'for'.format(STORIES, sum(driven for _, _, driven in RESULTS), len(BAD)))
    sys.exit(1 if BAD else 0)
