"""The scripts for a node of the Transformation lab, and calls of the node's reset.

The type of the reset is the handout's, ResetPose of this package, a type of std_srvs, or a
student's own type, of which only a request with the pose (0, 0, 0) is known.
"""
import math
import threading
import time

import rospy
from std_msgs.msg import Bool, Empty

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import CTRL_RELINQ, SET_POSE
from tb3_labs.marking.labs import move2goal as lab
from tb3_labs.marking.labs.criteria import LOST
from tb3_labs.marking.trial.observation import GOAL_POSE, LOCAL_T_WORLD, LONGEST, WAS_MOVING
from tb3_labs.marking.trial.ros_stimuli import ODOM_SWITCH, RESTS, WELL_UNDER_WAY
from tb3_labs.marking.trial.ros_student_node import OFFERS
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_quaternion
from tb3_labs.srv import ResetPoseRequest

#: The topic that resets the robot's odometry.
ROBOTS_RESET = 'reset'
#: A robot has arrived if it rests, and got no command to move for this time [s].
ARRIVAL = 1.5
#: The pose that the part `declared` declares.
DECLARED_POSE = Pose2(0.2, 0.3, math.radians(90.0))
OFFERS_NONE = 'it offers no service whose name has "reset" or "pose" in it'

#: The names of the reset by the handouts, the likeliest first. After these the marker looks for
#: other names with one of WORDS in them.
NAMES = ('reset_pose', 'reset', SET_POSE, 'reset_local_pose', 'set_local_pose')
WORDS = ('reset', 'pose')


def fields_of(message):
    """Yields (name, type, value) of each field of a message, and of the messages in it, without
    headers."""
    for name, kind in zip(message.__slots__, message._slot_types):
        value = getattr(message, name)
        if kind != 'std_msgs/Header':
            yield name, kind, value
            if hasattr(value, '_slot_types'):
                yield from fields_of(value)


def fill_pose(message, pose):
    """Fill a Pose2 into a request that has a geometry_msgs/Pose, or into a request of ResetPose.
    Returns False if the request has no fields for a pose."""
    for _, kind, value in fields_of(message):
        if kind == 'geometry_msgs/Pose':
            value.position.x, value.position.y = pose.x, pose.y
            value.orientation = to_quaternion(pose.yaw)
            return True
    if isinstance(message, ResetPoseRequest):
        message.x, message.y, message.yaw_deg = pose.x, pose.y, math.degrees(pose.yaw)
    return isinstance(message, ResetPoseRequest)


class ResetCaller:
    """Calls the reset service of a Trial's node. `found` is the name of the service, '' if the node
    has none; `wrong_name` is this name if it is not SET_POSE, else ''."""

    def __init__(self, trial):
        graph, self._recording = trial.node.graph, trial.recording
        bases = {name: name.rsplit('/', 1)[-1].lower() for name in graph.of_node(OFFERS)}
        likely = sorted(name for name, base in bases.items() if any(word in base for word in WORDS))
        usual = [name for wanted in NAMES for name in likely if bases[name] == wanted]
        self.found = (usual + likely + [''])[0]
        self.wrong_name = '' if rospy.resolve_name(SET_POSE) in bases else self.found
        self._kind = graph.service(self.found) if self.found else None
        #: Does its request have fields for a pose?
        self.takes_pose = self._kind is not None and fill_pose(self._kind._request_class(), Pose2())

    def call(self, pose):
        """Call the reset with a Pose2, and record the call. Returns the reason why the call failed,
        '' if it succeeded."""
        problem = self._problem_of_call(pose)[:LONGEST]
        self._recording.event('call', service=self.found, pose=[pose.x, pose.y, pose.yaw],
                              problem=problem)
        return problem

    def _problem_of_call(self, pose):
        if self._kind is None:
            return f'the type of {self.found} cannot be loaded'
        request = self._kind._request_class()
        fill_pose(request, pose)
        answers = []

        def call():
            try:
                response = rospy.ServiceProxy(self.found, self._kind)(request)
                refused = getattr(response, 'success', True) is False
                answers.append(f"it was refused: {getattr(response, 'message', '')}"[:200]
                               if refused else '')
            except (rospy.ServiceException, rospy.ROSException, TypeError) as problem:
                answers.append(str(problem)[:200])
        threading.Thread(target=call, daemon=True).start()
        if not wait_until(lambda: answers, lab.ANSWER_TIME):
            return f'{self.found} did not answer within {lab.ANSWER_TIME:g} s'
        return answers[0]


class Control:
    """Gives control of the robot to the node, and takes it away. At first the node has none."""

    def __init__(self, trial):
        self._trial = trial
        self._control = rospy.Publisher(CTRL_RELINQ, Bool, queue_size=1, latch=True)
        # a node may ignore a True that is the first message, since it may be an old one
        self.give(False)

    def give(self, given):
        """Give control to the node (True), or take it away (False)."""
        self._control.publish(given)

    def drive(self, name, local_T_base=Pose2(), start=None):
        """Record a drive as the stimulus `name`: give control, and wait until the robot has arrived
        or is too far away.

        `local_T_base` is the robot's pose in the local frame at its true pose `start`, by default
        the present one.
        """
        recorder = self._trial.recorder
        start = start or recorder.pose
        local_T_world = local_T_base @ start.inverse()
        self._trial.motion(
            name, lambda: self.give(True), lab.REACTION, ARRIVAL, lab.DRIVE_TIME,
            {GOAL_POSE: lab.GOAL,
             LOCAL_T_WORLD: [local_T_world.x, local_T_world.y, local_T_world.yaw]},
            lambda: recorder.pose.distance_to(start) > lab.ASTRAY)

    def start_driving(self):
        """Make the node drive. Returns what Trial.set_in_motion() returns.

        A node that runs and can be reset is reset. Any other node is started again.
        """
        return self._trial.set_in_motion(self._is_ready, lambda: self.give(True), lab.REACTION)

    def _is_ready(self):
        self.give(False)
        node = self._trial.node
        if not (node.alive and wait_until(self._trial.recorder.rests, RESTS)
                and reset_to_origin(self._trial)):
            node.stop()
        return node.alive


def reset_to_origin(trial):
    """Reset the node's frame to the robot's pose. Returns False if this is not possible."""
    caller = ResetCaller(trial)
    return bool(caller.found) and not caller.call(Pose2())


def drive(trial):
    """Start the node without control, then give control for a drive from the odometry's origin."""
    control = Control(trial)
    start = trial.recorder.pose
    trial.node.start()
    trial.watch(lab.WITHOUT_CONTROL, lab.WATCHED)
    control.drive(lab.FIRST_DRIVE, start=start)
    trial.watch(lab.AT_GOAL, lab.WATCHED)


def reset(trial):
    """Turn the robot, reset the frame, and give control for a second drive."""
    control = Control(trial)
    if not trial.node.alive:
        trial.node.start()
        trial.robot.leave_origin()
    time.sleep(0.3)
    trial.robot.face(trial.recorder.heading_deg + lab.TURNED)
    caller = ResetCaller(trial)
    if not caller.found:
        trial.not_offered([lab.RESET_TO_ORIGIN, lab.SECOND_DRIVE], OFFERS_NONE)
    if _reset(trial, lab.RESET_TO_ORIGIN, caller):
        control.drive(lab.SECOND_DRIVE)
        _reset_in_drive(trial, control, caller)


def _reset(trial, name, caller, pose=Pose2(), seconds=lab.TAKES_EFFECT, straight=True):
    """Record the reset to a pose as the stimulus `name`. Returns False if the reset failed."""
    facts = {WAS_MOVING: trial.recorder.moves(trial.recorder.now - WELL_UNDER_WAY),
             lab.STRAIGHT: straight, lab.NAME: caller.wrong_name}
    with trial.stimulus(name, facts) as record:
        problem = record.facts[lab.PROBLEM] = caller.call(pose)
        time.sleep(seconds)
    return not problem


def _reset_in_drive(trial, control, caller):
    """Reset the frame at the goal, turn the robot to the new goal, give control, and reset the
    frame again in the drive."""
    control.give(False)
    caller.call(Pose2())
    x, y, _ = lab.GOAL
    trial.robot.face(trial.recorder.heading_deg + math.degrees(math.atan2(y, x)))
    begun = trial.recorder.now
    control.give(True)
    straight = wait_until(
        lambda: any(row[1] for row in trial.recorder.commands_since(begun)), lab.REACTION)
    time.sleep(WELL_UNDER_WAY)
    _reset(trial, lab.RESET_IN_DRIVE, caller, seconds=lab.IN_DRIVE, straight=straight)
    control.give(False)


def control_taken(trial):
    """Take control away in a drive; then send Ctrl+C in another drive."""
    control = Control(trial)
    facts = {WAS_MOVING: control.start_driving()}
    trial.watch(lab.CONTROL_TAKEN, lab.WATCHED, lambda: control.give(False), facts)
    trial.ctrl_c_in_motion(control.start_driving)
    control.give(False)


def declared(trial):
    """Reset the frame to a pose that is not the origin, and give control for a drive."""
    control = Control(trial)
    trial.node.start()
    caller = ResetCaller(trial)
    if not caller.takes_pose:
        trial.not_offered([lab.RESET_ELSEWHERE, lab.DECLARED_DRIVE],
                          'its reset takes no pose' if caller.found else OFFERS_NONE)
    if _reset(trial, lab.RESET_ELSEWHERE, caller, DECLARED_POSE):
        control.drive(lab.DECLARED_DRIVE, DECLARED_POSE)


def offset(trial):
    """Set the odometry to zero, but not the IMU, by the robot's own reset; then give control for a
    drive."""
    control = Control(trial)
    trial.node.stop()
    board = rospy.Publisher(ROBOTS_RESET, Empty, queue_size=1)
    wait_until(board.get_num_connections, 5.0)
    if not trial.robot.face(100.0):     # [deg]: both zeros differ clearly after the reset
        trial.not_offered([lab.OFFSET_DRIVE],
                          'the robot did not come to rest, so that it could not be reset')
    board.publish()
    time.sleep(3.2)     # it recalibrates for less
    trial.node.start()
    reset_to_origin(trial)
    control.drive(lab.OFFSET_DRIVE)
    control.give(False)


def lost(trial):
    """Let the odometry fall silent in a drive."""
    control = Control(trial)
    trial.sensor_falls_silent(lab.ODOMETRY_SILENT, control.start_driving(), ODOM_SWITCH)
    control.give(False)


PARTS = {lab.DRIVE: drive, lab.RESET: reset, lab.CONTROL: control_taken, lab.DECLARED: declared,
         lab.OFFSET: offset, LOST: lost}
