"""A drive that is known in closed form, as arrays and as a bag, for the tests of the report.

The robot drives straight along local's x axis, a little too short, turning by a tenth of a degree
each second. Its error by the ground truth is larger. Then it is reset in place, and gives up.
Places are complex numbers, so that the truth does not come from the code under test.
"""
import math
from dataclasses import replace

import numpy as np
import pytest
from made_run import goals, imu_samples, reset_lines, speeds_sent, states

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import OdometrySamples, Poses, RunData
from tb3_labs.robot.turtlebot3 import robot_model

rosbag = pytest.importorskip('rosbag', reason='rosbag cannot be imported')

import rospy
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tb3_labs.ros.conversions import to_pose_stamped, to_quaternion, to_transform, to_twist

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
TIME, OFTEN = np.arange(241) / 20.0, np.arange(1201) / 100.0


def way(time):
    """(fraction of the way, yaw [rad]) in the first local frame."""
    yaw_deg = np.interp(time, [1.0, 6.0, 7.0], [0.0, 0.5, MISS_DEG])
    return np.interp(time, [1.0, 6.0], [0.0, 1.0]), np.radians(yaw_deg)


def placed(frame, place, yaw):
    """A pose of `frame` seen from its parent: (place, yaw)."""
    return frame[0] + np.exp(1j * frame[1]) * place, frame[1] + yaw


def frame_at(time):
    """The pose of local in odom: (place, yaw)."""
    place, yaw = placed(ODOM_T_LOCAL, 1.0 - MISS, math.radians(MISS_DEG))
    yaw -= DECLARED[1]
    later = place - np.exp(1j * yaw) * DECLARED[0], yaw
    # [()]: a number of a single time, since the approx of pytest 4 takes no array of 0 dimensions
    return [np.where(time < RESET, *pair)[()] for pair in zip(ODOM_T_LOCAL, later)]


def wrapped(yaw):
    return np.angle(np.exp(1j * yaw))


def columns(place, yaw):
    return place.real, place.imag, wrapped(yaw)


@pytest.fixture(scope='module')
def run():
    return known_run()


def known_run():
    fraction, yaw = way(TIME)
    often, often_yaw = way(OFTEN)
    here = (1.0 - MISS) * fraction + 0.0j, yaw
    local = [np.where(TIME < RESET, *pair) for pair in zip(here, DECLARED)]
    imu_yaw = wrapped(ODOM_T_LOCAL[1] + often_yaw + IMU_OFFSET)
    truth = placed(WORLD_T_LOCAL, TRUE_END * often, often_yaw * TRUE_DEG / MISS_DEG)
    linear = 0.1976 * ((TIME >= 1.0) & (TIME < 6.0))
    begins = [begin for begin, _ in STATES]
    return RunData(
        'run.bag', BEGIN, END,
        imu_samples(OFTEN, OFTEN, imu_yaw, 0.0 * OFTEN).take((OFTEN <= 7.2) | (OFTEN >= 8.0)),
        OdometrySamples(TIME, TIME, *columns(*placed(ODOM_T_LOCAL, *here)), linear,
                        np.where(TIME == 5.0, -143.6, 0.0)),
        commands=speeds_sent(TIME, TIME, 0.0 * TIME, 0.0 * TIME),
        local_pose=Poses(TIME, TIME, *columns(*local)), states=states(*STATES),
        ground_truth=Poses(OFTEN, OFTEN, *columns(*truth)), goals=goals(begins, 1.0),
        frames=Poses(TIME, TIME, *columns(*frame_at(TIME))), resets=reset_lines(RESET))


def sensors(run):
    """(time, topic, message) of each message of the robot."""
    for time, yaw in zip(run.imu.time, run.imu.yaw):
        message = Imu(orientation=to_quaternion(yaw))
        message.header.stamp = rospy.Time.from_sec(BEGIN + time + AHEAD)
        yield time, 'imu', message
    odometry = run.odometry
    for k, time in enumerate(odometry.time):
        message = Odometry()
        message.header.stamp = rospy.Time.from_sec(BEGIN + time + AHEAD)
        message.pose.pose = to_pose_stamped(odometry.pose(k), 'odom', 0.0).pose
        message.twist.twist = to_twist(odometry.linear[k], odometry.angular[k])
        yield time, 'odom', message


def lab_topics(run):
    """(time, topic, message) of each further message, sent by the package."""
    for topic, poses, ahead in (('ground_truth', run.ground_truth, AHEAD),
                                ('local_pose', run.local_pose, AHEAD),
                                ('current_goal', run.goals, 0.0)):     # from the laptop
        for k, time in enumerate(poses.time):
            yield time, topic, to_pose_stamped(poses.pose(k), 'local', BEGIN + time + ahead)
    for k, time in enumerate(run.frames.time):
        yield time, '/tf', TFMessage([
            to_transform(pose, 'odom', child, BEGIN + time + AHEAD)
            for child, pose in (('base', Pose2()), ('local', run.frames.pose(k)))])
        yield time, 'cmd_vel', to_twist(0.0, 0.0)
    for time, text in zip(run.states.time, run.states.text):
        yield time, 'goal_state', String(text)
    for time in run.resets.time:
        line = Log(name='/move_to_goal', msg='Local pose set to x=1, y=0.5, yaw=90 deg')
        line.header.stamp = rospy.Time.from_sec(BEGIN + time + AHEAD)
        yield time, '/rosout', line


def write_bag(path, run=None, namespaces=('',), sources=(sensors, lab_topics),
              keep=lambda topic: True, clock=lambda time: time):
    """Record the run, once for each namespace; None: by relative names. `clock`: the time that the
    recorder's clock shows at each time [s]."""
    messages = [row for source in sources for row in source(run or known_run())]
    with rosbag.Bag(str(path), 'w') as bag:
        for time, name, message in sorted(messages, key=lambda row: row[0]):
            for namespace in namespaces if keep(name) else ():
                relative = name[0] == '/' or namespace is None
                bag.write(name if relative else namespace + '/' + name, message,
                          rospy.Time.from_sec(clock(BEGIN + time + DELAY)))
    return path


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run.bag')


def in_degrees(miss):
    return miss[0], abs(math.degrees(miss[1]))


def changed(poses, time, parent_T_frame):
    """The poses, from `time` on in the parent of their frame."""
    seen, now = poses.in_parent(parent_T_frame), poses.time > time - 0.01
    return replace(poses, **{name: np.where(now, getattr(seen, name), getattr(poses, name))
                             for name in ('x', 'y', 'yaw')})


def odometry_jumps(run, time, jump):
    """The odometry is moved by `jump` from `time` on, and ``local`` with it."""
    return replace(run, odometry=changed(run.odometry, time, jump),
                   frames=changed(run.frames, time, jump))
