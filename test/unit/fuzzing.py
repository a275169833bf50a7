"""Random messages, in random order and time, for the handlers of each node.

The cores of move_to_goal, controller and gamepad get messages with extreme or invalid numbers, and
valid messages in between, so that the robot is driven meanwhile. No message may cause an exception
other than a refusal (``ValueError`` where a message or a request is read), a command that is not
finite or beyond the limits, or a command without permission.

    python3 test/unit/fuzzing.py [number of messages, default 1000000] [seed]
"""
import math
import random
import sys
from types import SimpleNamespace

from tb3_labs.control.driving import make_law
from tb3_labs.control.goal import DriveConfig
from tb3_labs.control.turning import TurnConfig, make_turn
from tb3_labs.nodes.controller import ControllerCore
from tb3_labs.nodes.gamepad import GamepadCore
from tb3_labs.nodes.move_to_goal import MoveToGoalCore
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.ros.conversions import to_imu_sample, to_mouse, to_odometry_sample, to_pose2
from tb3_labs.supervision.arbitration import Driver, Holder

BURGER = robot_model('burger')
NASTY = (0.0, -0.0, 1.0, -1.0, math.pi, -math.pi, math.nan, math.inf, -math.inf, 1e308, -1e308,
         5e-324, 1e9, -1e9, 1e5, 0.1, 2.0 ** 53)
#: The lab's mouse may ask for this [m/s], [rad/s]; the robot clips it.
MOUSE = 0.5


class Chance(random.Random):
    """Random numbers, some of which are extreme or invalid."""

    def yes(self, one_in):
        return self.randrange(one_in) == 0

    def number(self, sane):
        """A number: `sane`, or an extreme or invalid one."""
        return self.choice(NASTY) if self.yes(40) else sane


class Fuzz:
    """Three cores, a robot that obeys only partly, and a clock with faults."""

    def __init__(self, chance):
        self.chance = chance
        self.now, self.ahead = 1000.0, 0.0
        self.steady = 5000.0    # the clock for input of people
        self.x = self.y = self.yaw = 0.0
        self.linear = self.angular = 0.0
        self.navigator = MoveToGoalCore(make_law(DriveConfig(), BURGER))
        self.controller = ControllerCore(make_turn(TurnConfig(), BURGER))
        self.pad = GamepadCore(PadConfig(), BURGER)
        self.commands = self.refused = 0
        self.acts = (10 * [self.imu] + 3 * [self.odometry] + 2 * [self.mouse, self.joy]
                     + [self.goal, self.reset, self.control, self.control, self.turn, self.law,
                        self.cancel, self.clock])

    def step(self):
        """One message, then the commands of all nodes."""
        passed = self.chance.choice((0.0, 0.001, 0.004, 0.005, 0.02))
        self.now += passed
        self.steady += passed
        try:
            self.chance.choice(self.acts)()
        except Refused:
            self.refused += 1
        self.look()

    # -- what comes

    def quaternion(self):
        number, half = self.chance.number, 0.5 * self.yaw
        return SimpleNamespace(w=number(math.cos(half)), x=number(0.0), y=number(0.0),
                               z=number(math.sin(half)))

    def header(self):
        stamp = 0.0 if self.chance.yes(50) else max(0.0, self.chance.number(self.now + self.ahead))
        return SimpleNamespace(stamp=SimpleNamespace(to_sec=lambda: stamp))

    def imu(self):
        self.yaw = math.remainder(self.yaw + 0.005 * self.angular, 2.0 * math.pi)
        message = SimpleNamespace(
            header=self.header(), orientation=self.quaternion(),
            angular_velocity=SimpleNamespace(z=self.chance.number(self.angular)))
        sample = read(to_imu_sample, message)
        self.controller.on_imu(sample, self.now)
        self.navigator.on_imu(sample, self.now)
        self.navigator.take_fix()

    def odometry(self):
        self.x += 0.02 * self.linear * math.cos(self.yaw)
        self.y += 0.02 * self.linear * math.sin(self.yaw)
        number = self.chance.number
        pose = SimpleNamespace(position=SimpleNamespace(x=number(self.x), y=number(self.y)),
                               orientation=self.quaternion())
        twist = SimpleNamespace(linear=SimpleNamespace(x=number(self.linear)),
                                angular=SimpleNamespace(z=number(self.angular)))
        self.navigator.on_odometry(read(to_odometry_sample, SimpleNamespace(
            header=self.header(), pose=SimpleNamespace(pose=pose),
            twist=SimpleNamespace(twist=twist))), self.now)
        self.navigator.take_fix()

    def mouse(self):
        active, x, y = read(to_mouse, SimpleNamespace(
            status=SimpleNamespace(data=not self.chance.yes(4)),
            xPos=self.chance.number(self.chance.uniform(-1.0, 1.0)),
            yPos=self.chance.number(self.chance.uniform(-1.0, 1.0))))
        self.controller.on_mouse(active, x, y, self.steady)

    def joy(self):
        axes = [self.chance.number(self.chance.uniform(-1.0, 1.0) if self.chance.yes(2) else 0.0)
                for _ in range(self.chance.choice((8, 8, 8, 8, 2, 0)))]
        buttons = [self.chance.randrange(2) if self.chance.yes(4) else 0
                   for _ in range(self.chance.choice((11, 11, 11, 1)))]
        read(self.pad.on_joy, axes, buttons, self.steady, self.header().stamp.to_sec())
        self.pad.take_reset()

    def place(self):
        number, uniform = self.chance.number, self.chance.uniform
        return read(to_pose2, SimpleNamespace(
            position=SimpleNamespace(x=number(uniform(-2.0, 2.0)), y=number(uniform(-2.0, 2.0))),
            orientation=self.quaternion()))

    def goal(self):
        read(self.navigator.set_goal, self.place())

    def reset(self):
        reset = read(self.navigator.reset, self.place(), self.now)
        if self.chance.yes(4):
            self.navigator.give_up_reset(reset)

    def control(self):
        sender = self.chance.choice(('hand', 'hand 2', 'pad', 'pad 2'))
        self.navigator.told_control(not self.chance.yes(3), self.steady, sender,
                                    sender.startswith('pad'), self.chance.yes(20))
        if self.chance.yes(2):
            self.pad.on_control(self.navigator.control_stands, self.steady)

    def turn(self):
        read(self.controller.ask, self.chance.number(self.chance.uniform(-360.0, 360.0)), self.now)

    def law(self):
        if self.chance.yes(4):
            law = self.chance.choice(('precise', 'lab'))
            self.navigator.set_law(make_law(DriveConfig(law=law), BURGER))
            self.controller.set_law(make_turn(TurnConfig(law=law), BURGER))

    def cancel(self):
        if self.chance.yes(8):
            self.navigator.cancel()

    def clock(self):
        """Time jumps: silence, a clock that goes back, one that is set."""
        if self.chance.yes(20):
            jump = self.chance.choice((0.3, 1.0, 3.0, -0.5, -100.0, 1e6))
            self.now = max(0.0, self.now + jump)
            self.steady += max(0.0, jump)
        if self.chance.yes(20):
            self.ahead = self.chance.choice((0.0, 0.8, -0.8, 100.0))
        if self.chance.yes(200):
            self.navigator = MoveToGoalCore(make_law(DriveConfig(), BURGER))    # started again

    # -- what goes out

    def look(self):
        now = self.now
        self.navigator.update_control(self.steady)
        self.controller.update(self.steady)
        if self.navigator.due(now):
            allowed = self.navigator.has_control
            command = self.navigator.command(now)
            assert command is None or allowed, 'command without permission'
            self.send(command, BURGER.max_linear, 1.5)
        if self.controller.due(now):
            by_mouse = self.controller.driver is Driver.MOUSE
            self.send(self.controller.command(now), *((MOUSE, MOUSE) if by_mouse else (0.0, 1.5)))
        if self.pad.due(self.steady):
            command = self.pad.command(self.steady)
            assert command is None or self.pad.holder is Holder.GAMEPAD
            self.send(command, BURGER.max_linear, BURGER.max_angular)
        self.navigator.take_news()
        self.navigator.take_end()
        self.navigator.status(now)
        self.controller.take_news()
        self.pad.take_news()
        self.pad.messages.take()

    def send(self, command, max_linear, max_angular):
        if command is None:
            return
        linear, angular = command
        assert math.isfinite(linear) and math.isfinite(angular), command
        assert abs(linear) <= max_linear + 1e-9 and abs(angular) <= max_angular + 1e-9, command
        self.commands += 1
        self.linear, self.angular = linear, angular


class Refused(Exception):
    """A message or a request was refused with a reason."""


def read(reader, *arguments):
    """Read as the bridge does: an unreadable message is refused, by ``ValueError`` alone."""
    try:
        return reader(*arguments)
    except ValueError as problem:
        assert str(problem) and 'math domain' not in str(problem), problem
        raise Refused(str(problem)) from None


def run(messages, seed):
    """(commands, refusals) of this number of messages."""
    fuzz = Fuzz(Chance(seed))
    for number in range(messages):
        try:
            fuzz.step()
        except Exception:
            print('seed {}, message {}'.format(seed, number))
            raise
    return fuzz.commands, fuzz.refused


if __name__ == '__main__':
    TOTAL = int(sys.argv[1]) if len(sys.argv) > 1 else 1000000
    SEED = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    SENT = [run(min(10000, TOTAL), SEED + part) for part in range(max(1, TOTAL // 10000))]
    print('{} messages, {} refused, {} commands: all finite and within the limits'.format(
        TOTAL, sum(refused for _, refused in SENT), sum(commands for commands, _ in SENT)))
