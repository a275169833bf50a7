"""The nodes of a story: the real cores, with messages that may wait, and with their oracles."""
from types import SimpleNamespace

from oracle import GoalOracle, HandOracle
from tb3_labs.control.speed_laws import LawStep, Twist2
from tb3_labs.geometry.se2 import AskedPose, Pose2
from tb3_labs.nodes.controller_core import ControllerCore
from tb3_labs.nodes.gamepad_core import GamepadCore
from tb3_labs.nodes.move_to_goal_core import MoveToGoalCore
from tb3_labs.nodes.pad import PadConfig, read_pad
from tb3_labs.robot.samples import ImuSample, Motion, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.supervision.driver import Driver
from tb3_labs.supervision.goal_requests import GoalRequest

#: A node looks at the clock, and a sensor or pad is heard, with this period.
TICK = 0.05
RENEWAL_PERIOD = 0.1
#: The clock of a pad or mouse, beside that of its node.
CLOCK = -77.0
#: A process that did not run for longer than the second must be told anew. Within the first it
#: may hear messages in any order.
STALL, OVER = 1.0, 2.0


class Process:
    """A node. While it sleeps, or a link to it is cut, the messages of each sender wait in order."""

    def __init__(self, world):
        self.world, self.robot = world, world.robot
        self.born_at = world.now
        self.tremble = 1e-6
        self.asleep_since = self.asleep_until = None
        self.backwards = False       # the order in which its threads run when it wakes
        self.stalled = False
        self.held = {}               # sender: until then its messages are held up
        self.waiting = {}

    def send(self, sender, method, *details):
        if self.asleep_since is not None or sender in self.held:
            self.waiting.setdefault(sender, []).append((method, details))
        else:
            getattr(self, method)(*details)

    def deliver(self, senders):
        for sender in senders:
            for method, details in self.waiting.pop(sender, ()):
                getattr(self, method)(*details)

    def look_at_clock(self):
        """Wake, and hear what was held up, when it is time."""
        now = self.world.now + 1e-9
        if self.asleep_since is not None and now >= self.asleep_until:
            self.wake()
        for sender in [sender for sender, until in self.held.items() if now >= until]:
            del self.held[sender]
            if self.asleep_since is None:
                self.deliver([sender])

    def wake(self):
        """Threads that read different senders run in any order."""
        slept_for = self.world.now - self.asleep_since
        self.asleep_since = None
        self.woke(slept_for)
        self.stalled = slept_for <= STALL
        self.deliver(sorted(set(self.waiting) - set(self.held), reverse=self.backwards))
        self.stalled = False

    def hear_robot(self):
        """Returns True if IMU and wheels were heard. They tremble, as sensors that are not frozen do.
        """
        robot, now = self.robot, self.world.now
        self.tremble = -self.tremble
        if robot.is_on:
            self.core.on_imu(ImuSample(now, self.tremble, self.tremble + robot.gyro_error), now,
                             robot.sends_wheels)
            if robot.sends_wheels:
                self.core.on_wheels(WheelSample(now, self.tremble, self.tremble))
        return robot.is_on

    def at(self, at):
        """The time of a person's action, as the oracle shall know it: what waited for a moment only
        has no order."""
        return self.world.now if self.stalled and at is not None else at


class Ahead:
    """A law that never finishes."""

    period = TICK
    distance_tolerance = 0.01
    command = Twist2(0.1, 0.2)

    def __init__(self):
        self._left = 1e4

    def start(self, *_):
        pass

    def resume(self, state, *_):
        return state

    def rotate_to_goal(self, *_):
        self._left -= 0.1
        return LawStep(self.command, self._left, False)

    move_forward = rotate_to_final = rotate_to_goal


class Turning(Ahead):
    """The same for turns."""

    MAX_ANGLE, MAX_ANGLE_IN_WORDS, extends, carries_error = 100.0, '', True, False

    extend = Ahead.start

    def step(self, *_):
        return self.rotate_to_goal()


class Still:
    """In place of the localizer: the robot is at the origin, and a reset is carried out at once."""

    has_resets = is_lost = False
    odom_T_local = None

    def __init__(self):
        self._resets = []

    def on_imu(self, *_):
        pass

    on_odometry = on_imu

    def reset(self, *_):
        self._resets.append(SimpleNamespace(done=True))

    def motion(self, _now):
        return Motion(Pose2(), 0.1, 0.2)

    def take_resets(self):
        resets, self._resets = self._resets, []
        return resets

    def take_jumps(self):
        return []


class Mover(Process):
    """move_to_goal, with its sensors."""

    def __init__(self, world, latched=(), has_control=False):
        super().__init__(world)
        self.core = MoveToGoalCore(Ahead(), has_control)
        self.core._localizer = Still()
        self.core.set_goal(Pose2(50.0))
        self.core.begin_control(world.now)
        self.unheard = {name for name, _ in latched}
        self.oracle = GoalOracle(world.now)
        if has_control:
            self.oracle.hear(world.now, 'start', True, world.now)
        self.has_control = False
        for name, word in latched:
            if word is not None:
                self.on_word(name, word, False, None, is_old=True)

    def on_word(self, sender, word, renews, at, is_old=False):
        """Of a sender that latches and was there before, the first word is doubtful."""
        now, doubtful = self.world.now, sender in self.unheard
        self.unheard.discard(sender)
        if not is_old:
            self.oracle.hear(now, sender, word, None if doubtful and word else self.at(at), renews)
        self.core.told_control(word, now, sender, renews, doubtful, is_old)

    def on_goal(self, sender, at):
        now, request = self.world.now, GoalRequest(AskedPose(Pose2(40.0)), sender)
        self.core.hear_goal(request, now)
        try:
            self.core.on_goal(request)
        except ValueError:
            return
        if at is not None:    # else it is repeated
            self.oracle.goal(now, self.at(at))

    def on_cancel(self, at):
        self.core.on_cancel(self.world.now)
        self.oracle.cancel(self.at(at))

    def on_reset(self):
        self.core.update_control(self.world.now)
        try:
            self.core.reset(AskedPose(Pose2()), self.world.now)
        except ValueError:
            return
        self.oracle.ask(self.world.now, 'goal')

    def woke(self, slept_for):
        if slept_for > OVER:
            self.oracle.slept(self.world.now)

    def tick(self):
        if self.asleep_since is not None:
            return
        core, now = self.core, self.world.now
        is_there = self.hear_robot()
        if is_there:
            core.on_odometry(OdometrySample(now, Pose2(self.tremble), 0.1, self.tremble), now)
        self.oracle.look(now, is_there)
        core.update_control(now)
        if core.due(now):
            self.world.judge(core.command(now), self.oracle)
        if core.control_stands is not self.has_control:
            self.has_control = core.control_stands
            for pad in self.world.pads:
                pad.send('mover', 'on_control', self.has_control)
        core.take_news()


class Pad(Process):
    """A gamepad node, and its pad in a person's hands."""

    def __init__(self, world, name):
        super().__init__(world)
        self.name = name
        self.core = GamepadCore(PadConfig(), robot_model('burger'))
        self.core.update(world.now)
        self.oracle = HandOracle(world.now)
        self.plugged, self.button, self.stick = True, None, 0.0
        self.said_at = 0.0
        self.clock = CLOCK
        self.say(world.now)

    def on_joy(self, button, stick, at, stamp):
        axes, buttons = [0.0, stick, 0.0, 0.0], [0] * 4
        if button is not None:
            buttons[button] = 1
        self.oracle.hear(self.world.now, stick != 0.0, self.at(at))
        self.core.on_joy(read_pad(axes, buttons, PadConfig()), self.world.now, stamp)
        self.say(at)

    def on_control(self, granted):
        self.core.on_control(granted, self.world.now)
        if granted:
            self.oracle.lose(self.world.now)

    def on_taken(self):
        self.core.on_taken(self.world.now)
        self.oracle.stop(self.world.now)

    def woke(self, slept_for):
        if slept_for > OVER:
            self.oracle.lose(self.world.now)

    def show(self):
        """The pad repeats its state."""
        if self.plugged:
            self.send('joy', 'on_joy', self.button, self.stick, self.world.now,
                      self.world.now + self.clock)

    def tick(self):
        self.show()
        if self.asleep_since is not None:
            return
        now = self.world.now
        self.core.update(now)
        if self.core.due(now):
            self.world.judge(self.core.command(now), self.oracle)
        self.say(now)
        if self.core.messages.grants and now - self.said_at >= RENEWAL_PERIOD - 1e-6:
            self.say_word(True, None)
        self.core.take_news()

    def say(self, at):
        """Say the words of the core, which an action at `at` caused."""
        for word in self.core.messages.take():
            self.say_word(word, at)
            at = at if not word else None    # the others of a grant are renewals

    def say_word(self, word, at):
        self.said_at = self.world.now
        self.world.tell(self.name, word, True, at)


class Turner(Process):
    """controller, with its IMU."""

    def __init__(self, world):
        super().__init__(world)
        self.core = ControllerCore(Turning())
        self.core.update(world.now)
        self.by_turn = GoalOracle(world.now)
        self.hands = world.hands
        self.by_mice = {name: HandOracle(world.now) for name in self.hands}

    def on_turn(self, at):
        self.core.update(self.world.now)
        try:
            self.core.ask(3600.0, self.world.now)
        except ValueError:
            return
        self.by_turn.hear(self.world.now, 'turn', True, self.at(at))
        self.by_turn.ask(self.world.now, 'goal')

    def on_mouse(self, name, active, y, at):
        """A mouse that is deactivated stops the others, too."""
        now, pushed, was_active = self.world.now, active and y != 0.0, self.core.mouse.active
        for other, oracle in self.by_mice.items():
            if other != name and self.by_mice[name].repeats and not active:
                oracle.lose(now)
        self.by_mice[name].hear(now, pushed, self.at(at), repeats=active)
        self.core.on_mouse(active, 0.0, y, now, name, at + CLOCK)
        if (was_active and not self.core.mouse.active) or (pushed and self.core.mouse.active):
            self.by_turn.hear(now, 'mouse', False, self.at(at))

    def woke(self, slept_for):
        if slept_for > STALL:
            for oracle in self.by_mice.values():
                oracle.lose(self.world.now)
        if slept_for > OVER:
            self.by_turn.slept(self.world.now)

    def tick(self):
        if self.asleep_since is not None:
            return
        core, now = self.core, self.world.now
        self.by_turn.look(now, self.hear_robot())
        core.update(now)
        if core.due(now):
            by_turn, command = core.driver is Driver.TURN, core.command(now)
            mouse = 'page' if command and command.linear < 0.0 else 'mouse'    # by their edges
            self.world.judge(command, self.by_turn if by_turn else self.by_mice[mouse])
        core.take_news()
