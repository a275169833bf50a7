"""Makes the bag of a trial from what is to be in it, as the marker records it, without a robot."""
import pytest

pytest.importorskip('rosbag', reason='rosbag cannot be imported')

import rospy
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import Header, String

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.marking.trial.ros_recording import Recording
from tb3_labs.report.bag.messages import LEVELS
from tb3_labs.ros.conversions import to_pose_stamped, to_quaternion, to_twist

#: The trial's time 0 [s since 1970].
BEGIN = 1.7e9


def write_trial(path, seen, log=()):
    """Write the bag of an Observation; its texts come at the end of each stimulus, and its sensors are true.

    `log`: [time, level, node, text].
    """
    recording = Recording(path)
    for _, add in sorted(_additions(recording, seen, log), key=lambda each: each[0]):
        add()
    recording.close()


def recorded(path, seen, **more):
    """The Observation that is read from the bag of this one."""
    write_trial(path, seen, **more)
    return read_trial(path)


def _additions(recording, seen, log):
    """(time [s], a function that records one value) for all values of an Observation."""
    def event(at, kind, **facts):
        return at, lambda: recording.event(kind, BEGIN + at, **facts)

    def message(at, topic, made):
        return at, lambda: recording.add(topic, made, BEGIN + at)
    yield event(0.0, 'trial', lab=seen.lab, node=seen.node)
    for run in seen.processes:
        yield event(run.begin, 'start', needed=run.needed)
        facts = {name: getattr(run, name) for name in (
            'unheard', 'nodes', 'listens', 'publishes', 'unconnected', 'ended_by_itself', 'status')}
        yield event(run.begin, 'run', **facts)
        if run.printed and not seen.stimuli:
            yield message(run.begin, 'printed', String(run.printed))
        if run.ready is not None:
            yield event(run.ready, 'ready')
        if run.end is not None:
            yield event(run.end, 'stop')
    for each in seen.stimuli:
        yield event(each.begin, 'begin', name=each.name)
        if each.printed:
            yield message(each.end - 2e-4, 'printed', String(each.printed))
        yield event(each.end, 'end', facts=each.facts, died=each.died)
    for begin, end in seen.own_moves:
        yield event(end, 'own move', seconds=end - begin)
    for texts, kind in ((seen.remarks, 'remark'), (seen.findings, 'finding')):
        for text in texts:
            yield event(0.0, kind, text=text)
    for name, why in seen.missing.items():
        yield event(0.0, 'not offered', names=[name], reason=why)
    if seen.marker_error:
        yield event(0.0, 'broken', text=seen.marker_error)
    for at, linear, angular in seen.commands:
        yield message(at, 'cmd_vel', to_twist(linear, angular))
    for at, x, y, yaw in seen.truth:
        yield message(at, 'ground_truth', to_pose_stamped(Pose2(x, y, yaw), 'world', BEGIN + at))
    for at, x, y, yaw in seen.truth if len(seen.truth) else [[0.0] * 4]:
        header = Header(stamp=rospy.Time.from_sec(BEGIN + at), frame_id='odom')
        odometry, imu = Odometry(header=header), Imu(header=header, orientation=to_quaternion(yaw))
        odometry.pose.pose = to_pose_stamped(Pose2(x, y, yaw), 'odom', 0.0).pose
        yield message(at, 'odom', odometry)
        yield message(at, 'imu', imu)
    levels = {word: number for number, word in LEVELS.items()}
    for at, level, node, text in log:
        yield message(at, '/rosout', Log(
            header=Header(stamp=rospy.Time.from_sec(BEGIN + at)), level=levels.get(level, 2),
            name=node, msg=text))
