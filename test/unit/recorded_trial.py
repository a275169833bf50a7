"""Makes the bag of a trial from an Observation, as the marker records it, without a robot."""
import pytest

pytest.importorskip('rosbag', reason='rosbag cannot be imported')

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Header, String

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.trial.ros_recording import TrialBag
from tb3_labs.ros.conversions import to_pose_stamped, to_quaternion, to_twist

#: The trial's time 0 [s since 1970].
BEGIN = 1.7e9


def true_sensors(at, pose):
    """(odometry, sample of the IMU) of a robot at a Pose2, at a time [s since 1970]."""
    header = Header(stamp=rospy.Time.from_sec(at), frame_id='odom')
    odometry = Odometry(header=header)
    odometry.pose.pose = to_pose_stamped(pose, 'odom', at).pose
    return odometry, Imu(header=header, orientation=to_quaternion(pose.yaw))


def write_trial(path, seen):
    """Write the bag of an Observation. Its texts come at the end of each stimulus, and its sensors are true."""
    bag, entries = TrialBag(path), []

    def event(at, kind, **facts):
        entries.append((at, lambda: bag.add_event(kind, BEGIN + at, **facts)))

    def message(at, topic, made):
        entries.append((at, lambda: bag.add(topic, made, BEGIN + at)))
    event(0.0, 'trial', lab=seen.lab, node=seen.node)
    for process in seen.processes:
        event(process.begin, 'start', needed=process.needed_topic)
        event(process.begin, 'run', listens=process.subscribed_topics, ended_by_itself=process.ended_by_itself)
        if process.printed and not seen.stimuli:
            message(process.begin, 'printed', String(process.printed))
        if process.ready is not None:
            event(process.ready, 'ready')
    for stimulus in seen.stimuli:
        event(stimulus.begin, 'begin', name=stimulus.name)
        if stimulus.printed:
            message(stimulus.end - 2e-4, 'printed', String(stimulus.printed))
        event(stimulus.end, 'end', facts=stimulus.facts, died=stimulus.died)
    for texts, kind in ((seen.remarks, 'remark'), (seen.findings, 'finding')):
        for text in texts:
            event(0.0, kind, text=text)
    if seen.marker_error:
        event(0.0, 'broken', text=seen.marker_error)
    for at, linear, angular in seen.commands:
        message(at, 'cmd_vel', to_twist(linear, angular))
    for at, *pose in seen.truth if len(seen.truth) else [[0.0] * 4]:
        odometry, imu = true_sensors(BEGIN + at, Pose2(*pose))
        message(at, 'ground_truth', to_pose_stamped(Pose2(*pose), 'world', BEGIN + at))
        message(at, 'odom', odometry)
        message(at, 'imu', imu)
    for _, record in sorted(entries, key=lambda entry: entry[0]):
        record()
    bag.close()
