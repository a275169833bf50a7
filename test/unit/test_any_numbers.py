"""Whatever numbers a message has: it is refused with a reason, or no command leaves the limits."""
import math

from hypothesis import given, settings
from hypothesis import strategies as st

from geometry_msgs.msg import Pose
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from tb3_labs.control.drive_law import DriveLaw
from tb3_labs.control.goal_state import DriveConfig
from tb3_labs.geometry.se2 import Pose2, RequestedPose
from tb3_labs.localization.localizer import Reset
from tb3_labs.msg import MouseController
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.mouse import to_mouse
from tb3_labs.nodes.controller.turns import TurnConfig, make_turn
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.ros.conversions import to_odometry_sample, to_pose2, to_quaternion
from tb3_labs.ros.sensor_topics import to_imu_sample
from tb3_labs.supervision.events import Event

BURGER = robot_model('burger')
FINITE = st.floats(-3.0, 3.0) | st.floats(allow_nan=False, allow_infinity=False)
STEPS = st.lists(st.tuples(
    st.sampled_from(['imu', 'odometry', 'goal', 'reset', 'turn', 'clock', 'grant']),
    st.tuples(FINITE, FINITE, FINITE)), max_size=12)


def numbers_in(value):
    """All numbers of a sample."""
    if isinstance(value, (int, float)):
        return [value]
    return [number for part in (value if isinstance(value, tuple) else vars(value).values())
            for number in numbers_in(part)]


@given(st.tuples(*[st.floats(-3.0, 3.0) | st.floats()] * 6), st.booleans())
@settings(max_examples=100)
def test_a_message_is_read_as_finite_numbers_or_refused_with_a_reason(numbers, is_heading):
    imu, odometry, mouse, pose = Imu(), Odometry(), MouseController(), Pose()
    for place in odometry.pose.pose, pose:
        place.position.x, place.position.y = numbers[:2]
    for held in imu, odometry.pose.pose, pose:
        if is_heading:
            held.orientation = to_quaternion(math.fmod(numbers[2], math.pi)
                                             if math.isfinite(numbers[2]) else 0.0)
        else:
            held.orientation.w, held.orientation.x, held.orientation.z = numbers[2:5]
    imu.angular_velocity.z = odometry.twist.twist.angular.z = numbers[5]
    mouse.xPos, mouse.yPos = numbers[:2]
    for read, message in ((to_imu_sample, imu), (to_odometry_sample, odometry), (to_pose2, pose),
                          (to_mouse, mouse)):
        try:
            sample = read(message)
        except ValueError as problem:
            assert str(problem) and 'math domain' not in str(problem)
        else:
            assert all(map(math.isfinite, numbers_in(sample)))


class Driven:
    """Both cores that drive by sensors; the sensors are right, except in a step that changes them."""

    def __init__(self):
        self.now, self.tremble = 1000.0, 1e-9
        self.mover = MoveToGoalCore(DriveLaw(DriveConfig(), BURGER), True)
        self.controller = ControllerCore(make_turn(TurnConfig(), BURGER))
        self.commands = 0
        self.run()
        for step in ('goal', (1.0, 1.0, 0.0)), ('turn', (90.0, 0.0, 0.0)):
            self.take(*step)
        self.run()
        assert self.commands > 2

    def take(self, what, numbers):
        """Do one step. A request of a person may be refused, a sample may not."""
        a, b, c = numbers
        yaw = math.fmod(c, math.pi)
        if what == 'imu':
            self.hear(ImuSample(abs(a), yaw, b))
        elif what == 'odometry':
            self.hear(None, OdometrySample(self.now, Pose2(a, b, yaw), c, a))
        elif what == 'clock':
            self.now += math.fmod(a, 3.0)
        elif what == 'grant':
            self.mover.on_ctrl_relinq(Event(False, self.now, 'hand'))
            self.mover.on_ctrl_relinq(Event(a > 0.0, self.now, 'hand'))
        else:
            try:
                if what == 'goal':
                    self.mover.set_goal(Pose2(a, b, yaw))
                elif what == 'reset':
                    self.mover.on_reset(Reset(RequestedPose(Pose2(a, b, yaw))), self.now, self.now)
                else:
                    self.controller.request_turn(a, self.now)
            except ValueError as problem:
                assert str(problem) and 'math domain' not in str(problem)

    def hear(self, imu=None, odometry=None):
        if imu:
            self.mover.on_imu(imu, self.now)
            self.controller.on_imu(imu, self.now)
        if odometry:
            self.mover.on_odometry(odometry, self.now)

    def run(self):
        """Let 0.2 s pass; each command is finite, within the limits, and permitted."""
        for _ in range(20):
            self.now, self.tremble = self.now + 0.01, -self.tremble
            self.hear(ImuSample(self.now, self.tremble, 0.0),
                      OdometrySample(self.now, Pose2(0.0, 0.0, self.tremble), 0.0, 0.0))
            for core in self.mover, self.controller:
                command = core.tick(self.now, self.now).command
                if command is not None:
                    self.commands += 1
                    assert core is self.controller or self.mover.has_control
                    assert abs(command[0]) <= BURGER.max_linear and abs(command[1]) <= 1.5
            self.mover.status(self.now)


@given(STEPS)
@settings(max_examples=30)
def test_no_number_makes_a_wild_command(steps):
    driven = Driven()
    for what, numbers in steps:
        driven.take(what, numbers)
        driven.run()
