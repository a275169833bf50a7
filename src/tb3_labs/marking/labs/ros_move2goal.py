"""The scripts for a node of the Transformation lab, and the reset that it offers.

The type of the reset is the handout's, ResetPose of this package, one of std_srvs, or a
student's own: of this only a request with the pose (0, 0, 0) is known.
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

#: The robot's own reset, a topic.
ROBOTS_RESET = 'reset'
#: A robot has arrived if it rests and had no command to move for this time [s].
ARRIVAL = 1.5
#: The pose for the reset of a node that takes any pose.
DECLARED_POSE = Pose2(0.2, 0.3, math.radians(90.0))
OFFERS_NONE = 'it offers no service whose name has "reset" or "pose" in it'

#: The reset's usual names by the handouts, likeliest first. Then come other names with one of WORDS
#: in them.
NAMES = ('reset_pose', 'reset', SET_POSE, 'reset_local_pose', 'set_local_pose')
WORDS = ('reset', 'pose')


def fields_of(message):
    """(name, type, value) of each field of a message and of the messages in it, without headers."""
    for name, kind in zip(message.__slots__, message._slot_types):
        value = getattr(message, name)
        if kind != 'std_msgs/Header':
            yield name, kind, value
            if hasattr(value, '_slot_types'):
                yield from fields_of(value)


def fill_pose(message, pose):
    """Fill a Pose2 into a request like SetInitialPose's, which has a geometry_msgs/Pose, or
    into one of ResetPose. Returns True if there is a place for it."""
    for _, kind, value in fields_of(message):
        if kind == 'geometry_msgs/Pose':
            value.position.x, value.position.y = pose.x, pose.y
            value.orientation = to_quaternion(pose.yaw)
            return True
    if isinstance(message, ResetPoseRequest):
        message.x, message.y, message.yaw_deg = pose.x, pose.y, math.degrees(pose.yaw)
    return isinstance(message, ResetPoseRequest)


class ResetCaller:
    """The reset service of the node of a Trial; `found`: its name, or ''; `astray`: its name if it
    is not SET_POSE, or ''."""

    def __init__(self, trial):
        graph, self._recording = trial.node.graph, trial.recording
        bases = {name: name.rsplit('/', 1)[-1].lower() for name in graph.of_node(OFFERS)}
        likely = sorted(name for name, base in bases.items() if any(word in base for word in WORDS))
        usual = [name for wanted in NAMES for name in likely if bases[name] == wanted]
        self.found = (usual + likely + [''])[0]
        self.astray = '' if rospy.resolve_name(SET_POSE) in bases else self.found
        self._kind = graph.service(self.found) if self.found else None
        #: Can its request declare any pose?
        self.takes_pose = self._kind is not None and fill_pose(self._kind._request_class(), Pose2())

    def call(self, pose):
        """Call the reset with a Pose2, and record the call. Returns the reason why it failed, else
        ''."""
        problem = self._ask(pose)[:LONGEST]
        self._recording.event('call', service=self.found, pose=[pose.x, pose.y, pose.yaw],
                              problem=problem)
        return problem

    def _ask(self, pose):
        if self._kind is None:
            return f'the type of {self.found} cannot be loaded'
        request = self._kind._request_class()
        fill_pose(request, pose)
        answers = []

        def ask():
            try:
                response = rospy.ServiceProxy(self.found, self._kind)(request)
                refused = getattr(response, 'success', True) is False
                answers.append(f"it was refused: {getattr(response, 'message', '')}"[:200]
                               if refused else '')
            except (rospy.ServiceException, rospy.ROSException, TypeError) as problem:
                answers.append(str(problem)[:200])
        threading.Thread(target=ask, daemon=True).start()
        if not wait_until(lambda: answers, lab.ANSWER_TIME):
            return f'{self.found} did not answer within {lab.ANSWER_TIME:g} s'
        return answers[0]


class Control:
    """Gives control of the robot to the node, and takes it; at first it is taken."""

    def __init__(self, trial):
        self._trial = trial
        self._control = rospy.Publisher(CTRL_RELINQ, Bool, queue_size=1, latch=True)
        # a node may ignore a first True as old: it gets a False before
        self.give(False)

    def give(self, given):
        """Give control to the node (True), or take it (False)."""
        self._control.publish(given)

    def drive(self, name, local_T_base=Pose2(), start=None):
        """The stimulus of a drive: control is given; it ends if the robot has arrived or is astray.

        `local_T_base`: the robot's pose in the local frame when its true pose was `start`, or now.
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
        """Have the node drive. Returns the same values as Trial.set_in_motion().

        A node that runs and can be reset drives again after a reset. Any other is started again.
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
    """Reset the node's frame, if the node offers it. Returns True if that succeeded."""
    caller = ResetCaller(trial)
    return bool(caller.found) and not caller.call(Pose2())


def drive(trial):
    """The node waits without control, drives from the odometry's origin, is silent at the goal."""
    control = Control(trial)
    start = trial.recorder.pose
    trial.node.start()
    trial.watch(lab.WITHOUT_CONTROL, lab.WATCHED)
    control.drive(lab.FIRST_DRIVE, start=start)
    trial.watch(lab.AT_GOAL, lab.WATCHED)


def reset(trial):
    """The marker turns the robot, resets the frame, and has the node drive again."""
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
    """Record the reset to a pose as the stimulus `name`. Did it succeed?"""
    facts = {WAS_MOVING: trial.recorder.moves(trial.recorder.now - WELL_UNDER_WAY),
             lab.STRAIGHT: straight, lab.NAME: caller.astray}
    with trial.stimulus(name, facts) as record:
        problem = record.facts[lab.PROBLEM] = caller.call(pose)
        time.sleep(seconds)
    return not problem


def _reset_in_drive(trial, control, caller):
    """The frame is reset at the goal, the robot turned to the new goal; on the way there the frame
    is reset again."""
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
    """Control is taken in the middle of a drive; then Ctrl+C in another."""
    control = Control(trial)
    facts = {WAS_MOVING: control.start_driving()}
    trial.watch(lab.CONTROL_TAKEN, lab.WATCHED, lambda: control.give(False), facts)
    trial.ctrl_c_in_motion(control.start_driving)
    control.give(False)


def declared(trial):
    """The frame is reset to a pose that is not the origin; then the node drives."""
    control = Control(trial)
    trial.node.start()
    caller = ResetCaller(trial)
    if not caller.takes_pose:
        trial.not_offered([lab.RESET_ELSEWHERE, lab.DECLARED_DRIVE],
                          'its reset takes no pose' if caller.found else OFFERS_NONE)
    if _reset(trial, lab.RESET_ELSEWHERE, caller, DECLARED_POSE):
        control.drive(lab.DECLARED_DRIVE, DECLARED_POSE)


def offset(trial):
    """The robot's own `reset` sets the odometry to zero, not the IMU; then the node drives."""
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
    """The odometry falls silent in the middle of a drive."""
    control = Control(trial)
    trial.sensor_falls_silent(lab.ODOMETRY_SILENT, control.start_driving(), ODOM_SWITCH)
    control.give(False)


PARTS = {lab.DRIVE: drive, lab.RESET: reset, lab.CONTROL: control_taken, lab.DECLARED: declared,
         lab.OFFSET: offset, LOST: lost}
