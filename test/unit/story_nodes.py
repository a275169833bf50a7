"""The nodes of a story. Each node has its real core, messages that may wait, and its rule."""
from reference_rule import GoalRule, HandRule
from tb3_labs.control.commands import LawStep
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Reset
from tb3_labs.nodes.gamepad.core import GamepadCore
from tb3_labs.nodes.gamepad.pad import PadConfig, read_pad
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import ImuSample, Motion, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.supervision.events import IncomingMessage, NoveltyFinder, Queue
from tb3_labs.supervision.goal_requests import GoalRequest, RequestedPose

#: A node looks at the clock, and a sensor or pad is heard, with this period.
TICK = 0.05
#: The clock of a pad, which differs from its node's.
CLOCK = -77.0
PAD = PadConfig()
#: A process that did not run for longer than the second must be reported again. Within the first it
#: may hear messages in any order.
STALL, OVER = 1.0, 2.0
#: A reset that took longer than this may declare another place [s].
LATE_RESET = 1.05


class Wrong(Exception):
    """A violation of the rule."""


class StoryNode:
    """A node. While it sleeps, or its link is cut, the messages of each sender wait in order."""

    def __init__(self, world):
        self.world, self.born_at = world, world.now
        self.asleep_since = self.asleep_until = None
        self.backwards = False       # the order in which its threads run when it wakes
        self.stalled = self.waking = False    # it wakes from a short sleep, or from a longer one
        self.held, self.waiting = {}, {}      # by sender: until then its messages are held up; its messages
        self.is_dead = False

    def send(self, sender, method, *details):
        if self.asleep_since is None and sender not in self.held and not self.is_dead:
            getattr(self, method)(*details)
        elif not self.is_dead:
            self.waiting.setdefault(sender, []).append((method, details))

    def deliver(self, senders):
        for sender in senders:
            for method, details in self.waiting.pop(sender, ()):
                getattr(self, method)(*details)

    def check_clock(self):
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
        slept_for, self.asleep_since = self.world.now - self.asleep_since, None
        self.woke(slept_for)
        self.stalled, self.waking = slept_for <= STALL, slept_for > STALL
        self.deliver(sorted(set(self.waiting) - set(self.held), reverse=self.backwards))
        self.stalled = self.waking = False

    def at(self, at):
        """Returns the time of a person's action for the rule. Messages that waited for a moment have no order."""
        return self.world.now if self.stalled and at is not None else at

    def judge_reset(self, at):
        """The frame is declared again, as a person asked for at `at`."""
        if self.waking or self.world.now - self.at(at) > LATE_RESET:
            raise Wrong('a reset counts where the robot is now, not where it was')


class Ahead:
    """A law of drives and of turns that never finishes."""

    period, distance_tolerance, MAX_ANGLE = TICK, 0.01, 100.0
    command, left = Twist2(0.1, 0.2), 1e4

    def start(self, *_):
        pass

    move_goal = start

    def step(self, *_):
        self.left -= 0.1
        return LawStep(self.command, self.left, False)

    rotate_to_goal = move_forward = rotate_to_final = step


class Still:
    """It replaces the localizer: the robot is at the origin, and a reset is carried out at once."""

    waiting_resets, is_lost = (), False
    odom_T_local = None
    resets, jumps = (), Queue()

    def on_imu(self, *_):
        pass

    on_odometry = on_command = pop_pose = on_imu

    def on_reset(self, reset, *_):
        reset.declared_pose = reset.requested_pose.pose
        self.resets += (reset,)

    def pop_ended_resets(self):
        resets, self.resets = self.resets, ()
        return resets

    def motion(self, _now):
        return Motion(Pose2(), 0.1, 0.2)


class Mover(StoryNode):
    """move_to_goal, with its sensors."""

    def __init__(self, world, has_control=False):
        super().__init__(world)
        self.novelty_finder, self.unheard = NoveltyFinder(world.senders, world.now), set(world.senders)
        self.ways = {}               # by sender: its SenderConnection
        self.core = MoveToGoalCore(Ahead(), has_control)
        self.core._localizer = Still()
        self.core.set_goal(Pose2(50.0))
        self.rule = GoalRule(world.now)
        if has_control:
            self.rule.hear(world.now, 'start', True, world.now)
        self.robot, self.tremble = world.robot, 1e-6
        self.has_control = None      # its pads do not know yet
        self.connect(sorted(world.senders))

    def connect(self, names):
        """From now on these senders are heard. Their latched words come at once; only a False from before this node's
        start is ignored, see Permission."""
        for name in names:
            connection = self.ways[name] = self.world.senders[name]._replace(connected_at=self.world.now)
            if connection.is_latched and name in self.world.words:
                self.on_ctrl_relinq(connection, self.world.words[name], None, self.world.now == self.born_at)

    def on_ctrl_relinq(self, connection, word, at, is_old=False):
        """A sender that latches, and was there before, is doubted at first."""
        now, novelty = self.world.now, self.novelty_finder.find(connection, self.world.now)
        doubtful = connection.sender in self.unheard and connection.is_latched and not connection.has_renewals
        self.unheard.discard(connection.sender)
        if word or not is_old:
            self.rule.hear(now, connection.sender, word,
                           None if word and (doubtful or self.waking) else self.at(at), connection.has_renewals)
        self.core.on_ctrl_relinq(IncomingMessage(word, now, connection.sender, novelty, connection.has_renewals))

    def on_goal(self, sender, at):
        now, request = self.world.now, GoalRequest(RequestedPose(Pose2(40.0)), sender)
        self.core.on_goal(request, now)
        if at is not None and not self.waking and self.core._requests.current_request is request:
            self.rule.goal(now, self.at(at))

    def on_cancel(self, at):
        self.core.on_cancel(self.world.now)
        self.rule.cancel(self.at(at))

    def on_reset(self, at):
        reset = Reset(RequestedPose(Pose2()))
        self.core.on_reset(reset, self.world.now, self.world.now)
        if not reset.reason:
            self.judge_reset(at)
            self.rule.ask(self.world.now, 'goal')

    def woke(self, slept_for):
        if self.backwards:
            self.hear_sensors()      # before any request
        if slept_for > OVER:
            self.rule.slept(self.world.now)

    def hear_sensors(self):
        """Send samples. Returns True if they arrived. They differ a little, so that no sensor seems frozen."""
        robot, now, tremble = self.robot, self.world.now, self.tremble
        self.tremble = -tremble
        if robot.is_on:
            self.core.on_imu(ImuSample(now, tremble, tremble + robot.gyro_error), now, robot.sends_wheels)
            if robot.sends_wheels:
                self.core.on_wheels(WheelSample(now, tremble, tremble))
            self.core.on_odometry(OdometrySample(now, Pose2(tremble), 0.1, tremble), now)
        return robot.is_on

    def tick(self):
        core, now = self.core, self.world.now
        self.rule.look(now, self.hear_sensors())
        output = core.tick(now, now)
        self.world.judge(output.command, self.rule)
        if output.has_control is not self.has_control:
            self.has_control = output.has_control
            for pad in self.world.pads:
                pad.send('mover', 'on_control', self.has_control)


class PadNode(StoryNode):
    """A gamepad node, and its pad in a person's hands."""

    def __init__(self, world, name):
        super().__init__(world)
        self.name = name
        self.core = GamepadCore(PAD, robot_model('burger'))
        self.rule = HandRule(world.now)
        self.plugged, self.button, self.stick, self.clock = True, None, 0.0, CLOCK
        self.decide(world.now)

    def on_joy(self, button, stick, at, stamp):
        axes, buttons = [0.0, stick, 0.0, 0.0], [0] * 4
        if button is not None:
            buttons[button] = 1
        self.rule.hear(self.world.now, stick != 0.0, self.at(at))
        self.core.on_joy(IncomingMessage(read_pad(axes, buttons, PAD), self.world.now, sent_at=stamp))
        self.decide(at)

    def on_control(self, granted):
        self.core.on_has_control(IncomingMessage(granted, self.world.now))
        if granted:
            self.rule.lose(self.world.now)
        self.decide(self.world.now)

    def on_taken(self):
        self.core.on_ctrl_relinq(IncomingMessage(False, self.world.now))
        self.rule.stop(self.world.now)
        self.decide(self.world.now)

    def woke(self, slept_for):
        if slept_for > STALL:
            self.rule.lose(self.world.now)

    def show(self):
        """The pad repeats its state."""
        if self.plugged:
            self.send('joy', 'on_joy', self.button, self.stick, self.world.now,
                      self.world.now + self.clock)

    def tick(self):
        self.decide(self.world.now)

    def decide(self, at):
        """Carry out what the core wants after an action at `at`."""
        output = self.core.tick(self.world.now)
        self.world.judge(output.command, self.rule)
        if output.is_reset_requested:
            self.judge_reset(at)
        for word in output.control_messages:
            for _ in range(1 if word else 2):    # as GamepadNode does
                self.world.tell(self.name, word, at)
            at = at if not word else None    # the others of a grant are renewals
        if output.renewal_is_due:
            self.world.tell(self.name, True, None)
