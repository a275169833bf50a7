"""Runs of students' nodes without a master: a node's text on a fake `rospy`, in virtual time.

    run = played(text_of('turtlebot_controller'), turn_scene(random.Random(1)), seed=1)

One thread plays the node, the simulated robot and a person; a node that waits (`input`, a sleep)
lets the world go on meanwhile, but not its own callback. The result is the RunData that
report/bag/ros_bag.py reads from a bag of imu, odom, cmd_vel, ctrl_relinq, joy, mouse_info, /rosout and
ground_truth. The times of rospy are kept to one STEP.
Units: seconds, metres, radians; degrees where a name ends in `_deg`.
"""
import builtins
import heapq
import itertools
import math
import random
import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, Tuple

import genpy
import numpy as np
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Header
from tb3_labs.msg import MouseController
from tb3_labs.srv import SetInitialPoseRequest

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.bag.budget import Budget
from tb3_labs.report.bag.messages import LEVELS, make_collectors, samples_of
from tb3_labs.report.run_data import PadSamples, RunData, Values
from tb3_labs.robot.samples import ImuSample
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig

NODES = Path(__file__).resolve().parents[2] / 'scripts'
STEP = 1.0 / 200.0      # of the world
TRUTH_EVERY = 4         # steps between two samples of the ground truth
PERSON_EVERY = 10       # steps between two looks of the person, and between two messages of a pad
EPOCH = 1.7e9           # the world's time 0 [s since 1970]
#: The robot's steady state: slower than this it rests [m/s], [rad/s].
REST = 0.002, 0.004
NEVER = math.inf
#: The recorded topics: {part of the RunData: its topic}.
TOPICS = dict(imu='/imu', odometry='/odom', commands='/cmd_vel', control='/ctrl_relinq',
              ground_truth='/ground_truth', log='/rosout', pad='/joy')


def text_of(node: str) -> str:
    """The text of a right node (turtlebot_controller, move2goal_tf, gamepad) as in its handout."""
    text = (NODES / 'plain_{}.py'.format(node)).read_text(encoding='utf-8')
    return re.sub('.* # added\n', '', text)


class Step(NamedTuple):
    """One thing that the person does: `what` is

    'type'      a letter, and Enter
    'control'   ctrl_relinq: True = a node may drive; the hand is off then
    'drive'     by hand: (m/s, rad/s), sent at 20 Hz until the next 'drive'; None: nothing is sent
    'declare'   a reset by /set_pose: (x, y, yaw)
    'joy'       (buttons held, forward -1..1, left -1..1), sent at 20 Hz
    'mouse'     (x, y) of an active mouse, sent at 20 Hz; None: it is not active
    'set'       {name: value} of the robot's settings
    'reset'     the robot's own reset
    'wait'      nothing.
    The next step comes when the robot has rested for `pause`, at the latest after `patience` [s].
    """

    what: str
    value: Any = None
    pause: float = NEVER
    patience: float = 1.0


@dataclass(frozen=True)
class Scene:
    """The robot, the person, and the other node in the room."""

    node: str                               # its name in ROS
    steps: Tuple[Step, ...]
    robot: SimulatorConfig
    devices: Tuple[str, ...] = ()
    other: str = ''                         # a right node that runs as well
    clock_offset: float = 0.0               # of the robot's stamps [s]
    mouse: bool = False                     # a mouse that is not active is at hand
    late: float = 0.0                       # the node starts after the recording [s]
    after: float = 0.7                      # the recording goes on after Ctrl+C [s]


def _robot(source: random.Random) -> SimulatorConfig:
    host = HOSTS[source.choice(('default', 'laptop', 'laptop', 'pi'))]
    return SimulatorConfig(
        start_x=source.uniform(-5.0, 5.0), start_y=source.uniform(-5.0, 5.0),
        start_yaw_deg=source.uniform(-180.0, 180.0), imu_offset_deg=source.uniform(-180.0, 180.0),
        imu_drift_deg_per_min=source.uniform(-0.5, 0.5), slip=source.uniform(0.0, 0.01),
        wheel_mismatch=source.uniform(-0.005, 0.005), seed=source.randrange(2 ** 31),
        **host, **NETWORKS[source.choice(('good', 'good', 'good', 'busy'))])


def turn_scene(source: random.Random) -> Scene:
    """The IMU lab: 3 to 6 letters, each of them when the last turn is over or lasts too long."""
    steps = [Step('wait', None, NEVER, source.uniform(1.0, 2.0))] + [
        Step('type', source.choice('lr'), source.uniform(1.2, 3.0), source.uniform(8.0, 12.0))
        for _ in range(source.randint(3, 6))]
    return Scene('controller', tuple(steps), _robot(source),
                 ('mouse_info',) if source.random() < 0.3 else (),
                 clock_offset=source.uniform(-0.8, 0.8), mouse=source.random() < 0.2)


def drive_scene(source: random.Random, zero: bool) -> Scene:
    """The Transformation lab: 2 or 3 drives, and a reset between two of them. `zero`: all resets
    declare (0, 0, 0), else about one in three."""
    steps = [Step('wait', None, NEVER, source.uniform(1.0, 2.0))]
    drives = source.randint(2, 3)
    for drive in range(drives):
        cut = drive == 0 and source.random() < 0.4
        steps.append(Step('control', True, source.uniform(1.5, 3.0),
                          source.uniform(4.0, 12.0) if cut else 60.0))
        if drive < drives - 1:
            steps += [Step('control', False, 0.5, 2.0), *_by_hand(source)]
            declared = (0.0, 0.0, 0.0) if zero or source.random() < 0.3 else tuple(
                source.uniform(-most, most) for most in (0.5, 0.5, math.pi))
            steps.append(Step('declare', declared, NEVER, source.uniform(0.5, 2.0)))
    return Scene('move_to_goal', tuple(steps), _robot(source), ('joy',),
                 clock_offset=source.uniform(-0.8, 0.8))


def _by_hand(source):
    sides = source.choice((-1.0, 1.0)), source.choice((-1.0, 1.0))
    yield Step('drive', (0.0, sides[0] * source.uniform(0.5, 1.2)), NEVER, source.uniform(1.0, 3.0))
    yield Step('drive', (source.uniform(0.1, 0.2), sides[1] * source.uniform(0.0, 0.5)), NEVER,
               source.uniform(1.0, 4.0))
    yield Step('drive', (0.0, 0.0), 0.5, 2.0)
    if source.random() < 0.5:
        yield Step('drive', None, NEVER, 0.2)


A, B, Y, X = 0, 1, 2, 3


def pad_scene(source: random.Random, buttons: Tuple[int, ...] = (A, B, Y, X)) -> Scene:
    """The gamepad beside a right move_to_goal: sticks, A, B and Y in their order, and others."""
    def press(name, wait):
        button = buttons[(A, B, Y, X).index(name)]
        return [Step('joy', ((button,), 0.0, 0.0), NEVER, source.uniform(0.06, 0.25)),
                Step('joy', ((), 0.0, 0.0), NEVER, wait)]

    def sticks():
        return [Step('joy', ((), source.uniform(-1.0, 1.0), source.uniform(-0.6, 0.6)), NEVER,
                     source.uniform(1.0, 3.0)), Step('joy', ((), 0.0, 0.0), NEVER, 1.0)]

    steps = [Step('wait', None, NEVER, 1.5), Step('joy', ((), 0.0, 0.0), NEVER, 1.0), *sticks()]
    for _ in range(source.randint(2, 3)):
        steps += press(Y, source.uniform(1.0, 3.0))
        if source.random() < 0.5:
            steps += press(X, source.uniform(1.0, 2.0))
        steps += press(A, source.uniform(6.0, 20.0)) + press(B, source.uniform(1.0, 2.0))
        steps += sticks()
    return Scene('gamepad', tuple(steps), _robot(source), ('joy',), 'move2goal_tf',
                 clock_offset=source.uniform(-0.8, 0.8))


def played(text: str, scene: Scene, seed: int, knows_letters: bool = False) -> RunData:
    """Returns the RunData of the node `text` in `scene`. An exception at its start ends it. A mark
    knows the letters that were typed, a bag does not."""
    world = _World(scene, seed)
    run = world.play(text)
    return replace(run, letters=world.letters) if knows_letters else run


class _End(BaseException):
    """The scene is over: Ctrl+C."""


def _callback(call, due=0.0, period=NEVER):
    """A thread of the node: it is not called while it waits. `due`, `period`: of a timer."""
    return SimpleNamespace(call=call, due=due, period=period, busy=False)


class _World:
    def __init__(self, scene, seed):
        self._scene, self._robot = scene, Simulator(scene.robot)
        self._jitter = random.Random('recorder {}'.format(seed))
        self.now, self._count, self._ended, self._last_arrival = 0.0, 0, False, 0.0
        self.subscribers, self.services = {}, {}    # topic: callbacks; name: handler
        self.timers, self.hooks, self._later = [], [], []
        self._numbers = itertools.count()
        self.typed, self._letters, self._hand, self._joy = [], [], None, None
        self._mouse = MouseController() if scene.mouse else None
        self._step, self._step_began, self._rest_since = -1, 0.0, 0.0
        self._recorded = make_collectors(TOPICS, '/', Budget())
        self._imu, self._odometry = Imu(), Odometry()

    # Time -----------------------------------------------------------------------------------------

    def play(self, text):
        try:
            self.advance(self._scene.late)
            if self._scene.other:
                _execute(text_of(self._scene.other), _Rospy(self, '/move_to_goal', False))
            _execute(text, _Rospy(self, '/' + self._scene.node))
            self.advance(NEVER)     # the main thread ended, others go on
        except _End:
            pass
        for hook in self.hooks:
            hook()
        self._ended = True
        self.timers, self.subscribers, self._later = [], {}, []
        self.advance(self.now + self._scene.after)
        samples = samples_of({part: collector for part, collector in self._recorded.items()
                              if len(collector.arrival)})
        return RunData('run.bag', EPOCH, self.now, devices=self._scene.devices,
                       topics={part: TOPICS[part] for part in samples if part in TOPICS},
                       dropped={part: 0 for part in samples}, **samples)

    @property
    def letters(self):
        """The letters that were typed: 1 for l, -1 for r."""
        time, side = np.array(self._letters).reshape(-1, 2).T
        return Values(time, time, side)

    def advance(self, until):
        """Let time pass; this is where a waiting thread waits."""
        while self.now < until - 1e-9:
            self._tick()

    def later(self, delay, call):
        heapq.heappush(self._later, (self.now + delay, next(self._numbers), call))

    def run(self, callback, *arguments):
        """Call the node. Its exceptions go to the log, as rospy does it."""
        if callback.busy:
            return
        callback.busy = True
        try:
            callback.call(*arguments)
        except Exception as error:      # whatever a student's code raises
            self.log(8, '/' + self._scene.node, 'bad callback: {!r}'.format(error))
            callback.due = NEVER        # rospy ends a timer's thread; a subscriber goes on
        callback.busy = False

    def _tick(self):
        self._count += 1
        self.now = self._count * STEP
        samples = self._robot.step(STEP)
        for sample in samples:
            self._record(sample)
        if self._count % TRUTH_EVERY == 0:
            self._keep('ground_truth', _place(self._robot.truth), self.now)
        for sample in samples:
            self.send('imu' if isinstance(sample, ImuSample) else 'odom', sample)
        while self._later and self._later[0][0] <= self.now + 1e-9:
            heapq.heappop(self._later)[2]()
        for timer in list(self.timers):
            if timer.due <= self.now + 1e-9 and not timer.busy:
                expected = timer.due
                self.run(timer, None)       # no node reads the event
                if timer.due < NEVER:       # as rospy.Rate: late ones are not made up for
                    late = self.now - expected > 2.0 * timer.period
                    timer.due = self.now + STEP if late else expected + timer.period
        if self._count % PERSON_EVERY == 0 and not self._ended:
            self._person()

    # The person -----------------------------------------------------------------------------------

    def _person(self):
        if any(abs(speed) > rest for speed, rest in zip(self._robot.true_velocity, REST)):
            self._rest_since = self.now
        steps, began = self._scene.steps, self._step_began
        pause, patience = steps[self._step][2:] if self._step >= 0 else (NEVER, 0.0)
        if self.now - max(self._rest_since, began) >= pause or self.now - began >= patience:
            self._step, self._step_began = self._step + 1, self.now
            if self._step == len(steps):
                raise _End
            self._do(*steps[self._step][:2])
        if self._hand is not None:
            self.command(*self._hand)
        if self._joy is not None:
            buttons, forward, left = self._joy
            self.send('joy', Joy(Header(), [0.0, forward, left, left, 0.0, 0.0],
                                 [int(number in buttons) for number in range(11)]))
        if self._mouse is not None:
            self.send('mouse_info', self._mouse)

    def _do(self, what, value):
        if what == 'type':
            self.typed.append(value)
            self._letters.append((self.now - 0.1, float('rl'.index(value)) * 2.0 - 1.0))
        elif what == 'control':
            self._hand = None
            self.control(value)
        elif what == 'drive':
            self._hand = value
        elif what == 'joy':
            self._joy = value
            self._keep('pad', (*[0.0] * PadSamples.AXES, *(
                float(number in value[0]) for number in range(PadSamples.BUTTONS))))
        elif what == 'mouse':
            self._mouse = MouseController(Header(), Bool(value is not None), *(value or (0.0, 0.0)))
        elif what == 'set':
            self._robot.configure(replace(self._robot.config, **value))
        elif what == 'reset':
            self._robot.reset()
        elif what == 'declare':
            request = SetInitialPoseRequest()
            request.pose.pose.pose = to_pose_stamped(Pose2(*value), '', 0.0).pose
            self.later(0.02, lambda: self.run(_callback(self.serve), 'set_pose', request))

    # The graph, and the recording -----------------------------------------------------------------

    def serve(self, name, request):
        return self.services[name](request)

    def send(self, topic, thing):
        listeners = self.subscribers.get(topic)
        if listeners:
            message = self._message(thing) if topic in ('imu', 'odom') else thing
            for listener in listeners:
                self.run(listener, message)

    def _message(self, sample):
        """The node keeps no message, so one object serves for all."""
        if isinstance(sample, ImuSample):
            _turn(self._imu.orientation, sample.yaw)
            self._imu.angular_velocity.z = sample.yaw_rate
            return self._imu
        place, twist = self._odometry.pose.pose, self._odometry.twist.twist
        place.position.x, place.position.y = sample.pose.x, sample.pose.y
        _turn(place.orientation, sample.pose.yaw)
        twist.linear.x, twist.angular.z = sample.linear, sample.angular
        return self._odometry

    def publish(self, topic, message):
        if topic == 'cmd_vel':
            self.command(message.linear.x, message.angular.z)
        elif topic == 'ctrl_relinq':
            self.control(message.data)
        else:
            self.send(topic, message)

    def command(self, linear, angular):
        self._robot.command(float(linear), float(angular))
        self._keep('commands', (linear, angular, *4 * [0.0]))

    def control(self, value):
        self._keep('control', (value,))
        self.later(STEP, lambda: self.send('ctrl_relinq', Bool(value)))

    def log(self, level, node, line):
        self._keep('log', (LEVELS[level], node, line), self.now)

    def _record(self, sample):
        stamp = sample.stamp + self._scene.clock_offset
        if isinstance(sample, ImuSample):
            half = sample.yaw / 2.0
            self._keep('imu', (sample.yaw, sample.yaw_rate, math.cos(half), 0.0, 0.0, math.sin(half)), stamp)
        else:
            self._keep('odometry', (*_place(sample.pose), sample.linear, sample.angular), stamp)

    def _keep(self, part, row, stamp=None):
        arrival = max(self._last_arrival, self.now + self._jitter.uniform(0.0, 0.003))
        self._last_arrival = arrival
        self._recorded[part].keep(row, arrival, arrival if stamp is None else stamp)


def _place(pose):
    return pose.x, pose.y, pose.yaw


def _turn(orientation, yaw):
    orientation.z, orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)


class _Rospy:
    """The module `rospy` of one node. Unless it `waits`, its spin() comes back at once."""

    ROSException = type('ROSException', (Exception,), {})
    ServiceException = type('ServiceException', (Exception,), {})
    Duration = genpy.Duration

    def __init__(self, world, node, waits=True):
        self.world, self.node, self.waits = world, node, waits
        for name, level in dict(loginfo=2, logwarn=4, logerr=8).items():
            setattr(self, name, self._logger(level))
        self.sleep = lambda seconds: world.advance(world.now + seconds)
        self.Time = SimpleNamespace(now=lambda: genpy.Time.from_sec(EPOCH + world.now))

    def _logger(self, level):
        def log(line, *values):
            self.world.log(level, self.node, str(line) % values if values else str(line))
        return log

    def init_node(self, *_, **__):
        pass

    def on_shutdown(self, hook):
        self.world.hooks.append(hook)

    def spin(self):
        if self.waits:
            self.world.advance(NEVER)

    def Timer(self, period, call):
        self.world.timers.append(_callback(call, self.world.now + period.to_sec(), period.to_sec()))

    def Subscriber(self, topic, _kind, call, **_):
        self.world.subscribers.setdefault(topic.lstrip('/'), []).append(_callback(call))

    def Publisher(self, topic, kind, **_):
        def publish(*values):
            message = values[0] if values and isinstance(values[0], kind) else kind(*values)
            self.world.publish(topic.lstrip('/'), message)
        return SimpleNamespace(publish=publish, get_num_connections=lambda: 1)

    def Service(self, name, _kind, call):
        self.world.services[name.lstrip('/')] = call

    def ServiceProxy(self, name, _kind):
        world, name = self.world, name.lstrip('/')

        def wait_for_service(timeout=1.0):
            if name not in world.services:
                world.advance(world.now + timeout)
                raise self.ROSException('timeout')

        def call(request):
            return world.serve(name, request)
        call.wait_for_service = wait_for_service
        return call


def _execute(text, rospy):
    world = rospy.world

    def thread(target, args=(), daemon=None):
        return SimpleNamespace(start=lambda: world.later(0.003, lambda: target(*args)))

    fakes = {'rospy': rospy, 'threading': SimpleNamespace(Thread=thread)}

    def imported(name, globals_=None, locals_=None, wanted=(), level=0):
        return fakes[name] if name in fakes else __import__(name, globals_, locals_, wanted, level)

    def answer(*_):
        while not world.typed:
            world.advance(world.now + STEP)
        return world.typed.pop(0)

    own = dict(vars(builtins), __import__=imported, input=answer, print=lambda *_, **__: None)
    exec(compile(text, 'student.py', 'exec'), {'__builtins__': own, '__name__': '__main__'})
