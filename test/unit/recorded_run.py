"""A drive that is known in closed form, recorded as a bag, for the tests of the report.

The robot drives straight along local's x axis, a little too short, turning by a tenth of a degree
each second. Its error by the ground truth is larger. Then it is reset in place, and gives up.
"""
import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.run_data import Poses
from tb3_labs.robot.turtlebot3 import robot_model

rosbag = pytest.importorskip('rosbag', reason='rosbag cannot be imported')

import rospy  # noqa: E402
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from tb3_labs.report.ros_bag import read_run  # noqa: E402

BURGER = robot_model('burger')
BEGIN = 1.7e9                            # of the recording
AHEAD, DELAY = 0.775, 0.002              # of the robot's clock; of the network
ODOM_T_LOCAL = 2.0 + 1.0j, 0.5           # (place, yaw): where local stands at first
WORLD_T_LOCAL = -3.0 + 4.0j, 2.0
IMU_OFFSET = math.radians(140.56)
MISS, MISS_DEG = 0.012, 0.7              # by local_pose
TRUE_END, TRUE_DEG = 0.97 + 0.04j, 2.0   # 0.05 m from the goal
RESET, DECLARED = 10.0, (1.0 + 0.5j, math.pi / 2.0)
STATES = ((0.5, 'ROTATE_TO_GOAL'), (1.0, 'MOVE_FORWARD'), (6.0, 'ROTATE_TO_FINAL'),
          (7.0, 'GOAL_REACHED'), (10.02, 'ROTATE_TO_GOAL'), (11.5, 'gave up: it is stuck, alas'))
END = 12.0


def way(time):
    """(fraction of the way, yaw [rad]) in the first local frame."""
    yaw_deg = np.interp(time, [1.0, 6.0, 7.0], [0.0, 0.5, MISS_DEG])
    return float(np.interp(time, [1.0, 6.0], [0.0, 1.0])), math.radians(yaw_deg)


def placed(frame, place, yaw):
    """A pose of `frame` seen from its parent: (place, yaw)."""
    return frame[0] + cmath.exp(1j * frame[1]) * place, frame[1] + yaw


def fill(pose, place, yaw):
    """Write (place, yaw) into a Pose or a Transform."""
    position = getattr(pose, 'position', None) or pose.translation
    orientation = getattr(pose, 'orientation', None) or pose.rotation
    position.x, position.y = place.real, place.imag
    orientation.z, orientation.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)


def stamped(message, time, frame='', ahead=AHEAD):
    message.header.stamp = rospy.Time.from_sec(BEGIN + time + ahead)
    message.header.frame_id = frame
    return message


def sensors(time, number):
    """(name, message) of each message of the robot at `time`."""
    fraction, yaw = way(time)
    place, odom_yaw = placed(ODOM_T_LOCAL, (1.0 - MISS) * fraction, yaw)
    if not 7.2 < time < 8.0:             # a gap, put in on purpose
        imu = stamped(Imu(), time, 'imu_link')
        imu.orientation.z = math.sin((odom_yaw + IMU_OFFSET) / 2.0)
        imu.orientation.w = math.cos((odom_yaw + IMU_OFFSET) / 2.0)
        yield 'imu', imu
    if number % 5 == 0:
        odometry = stamped(Odometry(), time, 'odom')
        odometry.child_frame_id = 'base_footprint'
        fill(odometry.pose.pose, place, odom_yaw)
        odometry.twist.twist.linear.x = 0.1976 if 1.0 <= time < 6.0 else 0.0
        odometry.twist.twist.angular.z = -143.6 if number == 500 else 0.0
        yield 'odom', odometry


def lab_topics(time, number):
    """(name, message) of each further message, sent by the package."""
    fraction, yaw = way(time)
    truth = stamped(PoseStamped(), time, 'world')
    fill(truth.pose, *placed(WORLD_T_LOCAL, TRUE_END * fraction, yaw * TRUE_DEG / MISS_DEG))
    yield 'ground_truth', truth
    if number % 5 == 0:
        local = stamped(PoseStamped(), time, 'local')
        fill(local.pose, *(DECLARED if time >= RESET else ((1.0 - MISS) * fraction, yaw)))
        yield 'local_pose', local
        transform = stamped(TransformStamped(), time, 'odom')
        transform.child_frame_id = 'local'
        fill(transform.transform, *frame_at(time))
        yield '/tf', TFMessage([stamped(TransformStamped(), time, 'odom'), transform])
        yield 'cmd_vel', Twist()
    for begin, state in STATES:
        if abs(time - begin) < 1e-6:
            yield 'goal_state', String(state)
            goal = stamped(PoseStamped(), time, 'local', ahead=0.0)   # from the laptop
            fill(goal.pose, 1.0 + 0.0j, 0.0)
            yield 'current_goal', goal


def frame_at(time):
    """The pose of local in odom: (place, yaw)."""
    if time < RESET:
        return ODOM_T_LOCAL
    place, yaw = placed(ODOM_T_LOCAL, 1.0 - MISS, math.radians(MISS_DEG))
    yaw -= DECLARED[1]
    return place - cmath.exp(1j * yaw) * DECLARED[0], yaw


def write_bag(path, namespaces=('',), sources=(sensors, lab_topics), keep=lambda name: True, **how):
    """Record the drive, once for each namespace; None: by relative names."""
    with rosbag.Bag(str(path), 'w', **how) as bag:
        for number in range(int(END * 100) + 1):
            time = number / 100.0
            for name, message in (pair for source in sources for pair in source(time, number)):
                for namespace in namespaces if keep(name) else ():
                    relative = name[0] == '/' or namespace is None
                    topic = name if relative else namespace + '/' + name
                    bag.write(topic, message, rospy.Time.from_sec(BEGIN + time + DELAY))
    return path


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run.bag')


@pytest.fixture(scope='module')
def run(bag):
    return read_run(bag)


def in_degrees(miss):
    return miss[0], abs(math.degrees(miss[1]))


def recorded(run, by_tf):
    """The run with or without tf."""
    return run if by_tf else replace(run, frames=Poses.none())


def changed(poses, time, parent_T_frame, until=math.inf):
    """The poses, from `time` on in the parent of their frame."""
    seen, now = poses.seen_from(parent_T_frame), (poses.time > time - 0.01) & (poses.time < until)
    return replace(poses, **{name: np.where(now, getattr(seen, name), getattr(poses, name))
                             for name in ('x', 'y', 'yaw')})


def odometry_jumps(run, time, jump):
    """The odometry is moved by `jump` from `time` on, and ``local`` with it."""
    return replace(run, odometry=changed(run.odometry, time, jump),
                   frames=changed(run.frames, time, jump))


def steps_backwards(run, time, driven):
    """The IMU crosses +/-180 deg: the way `driven` before `time` [m] is reversed in odom."""
    k = np.searchsorted(run.odometry.time, time - 0.01)
    yaw, angular, linear = run.odometry.yaw[k], *np.array(
        [run.odometry.angular, run.odometry.linear])
    angular[k], linear[k] = -188.0, driven / 0.05
    run = odometry_jumps(run, time, Pose2(-2.0 * driven * math.cos(yaw),
                                          -2.0 * driven * math.sin(yaw)))
    return replace(run, odometry=replace(run.odometry, angular=angular, linear=linear))


def declared(run, time, new_T_old, until=RESET):
    """A reset at `time`: ``local`` is another one until the next reset."""
    x, y, yaw = (np.full(len(run.frames), value) for value in (
        new_T_old.x, new_T_old.y, new_T_old.yaw))
    frames = run.frames @ Poses(run.frames.time, run.frames.time, x, y, yaw).inverse()
    now = (frames.time > time - 0.01) & (frames.time < until - 0.01)
    return replace(
        run, local_pose=changed(run.local_pose, time, new_T_old, until - 0.01),
        frames=replace(run.frames, **{name: np.where(
            now, getattr(frames, name), getattr(run.frames, name)) for name in ('x', 'y', 'yaw')}))
