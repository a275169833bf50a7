"""Scripts for the trials of the Transformation lab, and calls of the node's reset service.

The service has the handout's type, ResetPose of this package, a type of std_srvs, or a type that
the student made. The marker does not know what the fields of a student's type mean. Therefore a
request of a student's type always contains the pose (0, 0, 0).
"""
import math
import threading
import time

import rospy
from std_msgs.msg import Bool, Empty

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import CTRL_RELINQ_TOPIC, SET_POSE_SERVICE
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.trial.observation import (
    GOAL_POSE, LOCAL_T_WORLD, MAX_SENTENCE_LENGTH, WAS_MOVING)
from tb3_labs.marking.trial.ros_stimuli import INTERRUPTION_TIME, ODOM_SWITCH, STOP_REST_TIME
from tb3_labs.marking.trial.ros_student_node import SERVER
from tb3_labs.ros.clocks import ros_time, wait_until
from tb3_labs.ros.conversions import to_quaternion
from tb3_labs.srv import ResetPoseRequest
from tb3_labs.watch.lab_mistakes import LOCAL_POSE_SECTION

ODOMETRY_RESET_TOPIC = 'reset'      # A message on this topic resets the robot's board.
#: A robot has arrived if it rests, and if its node has sent no command to move for this time [s].
ARRIVAL_IDLE_TIME = 1.5
DECLARED_POSE = Pose2(0.2, 0.3, math.radians(90.0))     # of the part `declared`
CONNECTION_TIME = 1.0       # A node that listens to ctrl_relinq connects within this time [s].
OFFERS_NO_RESET = 'it offers no service whose name has "reset" or "pose" in it'
#: The names of the reset service in the handouts, the likeliest name first.
RESET_NAMES = ('reset_pose', 'reset', SET_POSE_SERVICE, 'reset_local_pose', 'set_local_pose')
#: The name of a reset service contains one of these words.
RESET_WORDS = ('reset', 'pose')


def fields_of(message, prefix=''):
    """Yields (name, type, value) for each field of a message, except headers. After a field that is
    a message, yields the fields of this message, with names such as pose.position.x."""
    for name, type_name in zip(message.__slots__, message._slot_types):
        value = getattr(message, name)
        if type_name != 'std_msgs/Header':
            yield prefix + name, type_name, value
            if hasattr(value, '_slot_types'):
                yield from fields_of(value, f'{prefix}{name}.')


def fill_pose(message, pose):
    """Write a Pose2 into a request. Returns False if the request is no ResetPoseRequest and has
    no geometry_msgs/Pose."""
    if isinstance(message, ResetPoseRequest):
        message.x, message.y, message.yaw_deg = pose.x, pose.y, math.degrees(pose.yaw)
        return True
    for _, type_name, value in fields_of(message):
        if type_name == 'geometry_msgs/Pose':
            value.position.x, value.position.y = pose.x, pose.y
            value.orientation = to_quaternion(pose.yaw)
            return True
    return False


class ResetCaller:
    """Calls the reset service of a Trial's node."""

    def __init__(self, trial):
        self._bag = trial.bag
        graph = trial.node.graph
        services = graph.names_by_role()[SERVER]
        #: The name of the node's reset service; '' if the node offers none.
        self.name = _likeliest_reset(services)
        #: A wrong name of the reset service; '' if the service is called SET_POSE_SERVICE.
        self.wrong_name = '' if rospy.resolve_name(SET_POSE_SERVICE) in services else self.name
        self._service_class = graph.service_class(self.name) if self.name else None

    def takes_pose(self):
        """Returns True if a request of the service has fields for a pose."""
        return (self._service_class is not None
                and fill_pose(self._service_class._request_class(), Pose2()))

    def remarks(self):
        """Returns a list with a sentence on a type of std_srvs, which has no fields for a pose."""
        type_name = '' if self._service_class is None else self._service_class._type
        if not type_name.startswith('std_srvs/'):
            return []
        return [f'{self.name} has the type {type_name}, which takes no pose: neither gamepad.py '
                'nor the call in the sheet can reset the frame. '
                f'See {LOCAL_POSE_SECTION.at_step(1)}.']

    def call_service(self, pose=Pose2()):
        """Call the reset service with a Pose2 and record the call. Returns a text that says why the
        call failed; '' if it succeeded."""
        problem = self._call_problem(pose)[:MAX_SENTENCE_LENGTH]
        self._bag.add_event('call', service=self.name, pose=[pose.x, pose.y, pose.yaw],
                            problem=problem)
        return problem

    def _call_problem(self, pose):
        if self._service_class is None:
            return f'the type of {self.name} cannot be loaded'
        request = self._service_class._request_class()
        fill_pose(request, pose)
        answers = []

        def get_answer():
            problem = ''
            try:
                response = rospy.ServiceProxy(self.name, self._service_class)(request)
                if getattr(response, 'success', True) is False:
                    problem = f"it was refused: {getattr(response, 'message', '')}"
            except (rospy.ServiceException, rospy.ROSException, TypeError) as error:
                problem = str(error)
            answers.append(problem[:200])
        threading.Thread(target=get_answer, daemon=True).start()
        if not wait_until(lambda: answers, stimuli.RESET_REPLY_TIME):
            return f'{self.name} did not answer within {stimuli.RESET_REPLY_TIME:g} s'
        return answers[0]


def _likeliest_reset(services):
    """Returns the likeliest name of a reset service; '' if `services` has no such name."""
    last_names = {name: name.rsplit('/', 1)[-1].lower() for name in sorted(services)}
    resets = [name for name, last_name in last_names.items()
              if any(word in last_name for word in RESET_WORDS)]
    for usual_name in RESET_NAMES:
        for name in resets:
            if last_names[name] == usual_name:
                return name
    return resets[0] if resets else ''


class ControlGiver:
    """Gives control of the robot to the node and takes control away. At first the node does not
    have control."""

    def __init__(self, trial):
        self._trial = trial
        self._control = rospy.Publisher(CTRL_RELINQ_TOPIC, Bool, queue_size=1, latch=True)
        self.take_away()    # a node may ignore a True before the first False

    def wait_for_node(self):
        """Wait until the node, if it listens, has received that it does not have control."""
        wait_until(self._control.get_num_connections, CONNECTION_TIME)

    def give(self):
        self._control.publish(Bool(True))

    def take_away(self):
        self._control.publish(Bool(False))

    def drive(self, name, local_T_base=Pose2(), start=None):
        """Give control, and record the drive to the goal as the stimulus `name`.

        `start` is a true pose of the robot, by default the current pose. `local_T_base` is the same
        pose in the local frame. The stimulus ends if the robot arrives or is too far from `start`.
        """
        recorder = self._trial.recorder
        if start is None:
            start = recorder.pose
        local_T_world = local_T_base @ start.inverse()
        self._trial.record_motion(
            name, self.give, reaction_time=stimuli.DRIVE_REACTION_TIME, idle_time=ARRIVAL_IDLE_TIME,
            max_duration=stimuli.MAX_DRIVE_TIME, facts={
                GOAL_POSE: stimuli.GOAL,
                LOCAL_T_WORLD: [local_T_world.x, local_T_world.y, local_T_world.yaw]},
            is_astray=lambda: recorder.pose.distance_to(start) > stimuli.MAX_DRIVE_DISTANCE)

    def start_driving(self):
        """Make the node drive. Returns True if the robot drives. A node that runs is reset first,
        so that it has a new goal. A node that ended or cannot be reset is started again."""
        return self._trial.set_in_motion(self._prepare, self.give, stimuli.DRIVE_REACTION_TIME)

    def _prepare(self):
        self.take_away()
        node = self._trial.node
        is_idle = node.is_alive and wait_until(self._trial.recorder.is_at_rest, STOP_REST_TIME)
        if not (is_idle and reset_to_origin(self._trial)):
            node.stop()
        return node.is_alive


def reset_to_origin(trial):
    """Reset the node's frame to the robot's place. Returns False if the reset failed."""
    caller = ResetCaller(trial)
    return bool(caller.name) and not caller.call_service()


def try_drive(trial):
    """Start the node without control. Then give control for a drive from the odometry's origin."""
    start = trial.recorder.pose
    trial.node.start()
    with trial.stimulus(stimuli.WITHOUT_CONTROL):
        # first nothing is published: a False would stop a node that wrongly starts with control
        time.sleep(stimuli.OBSERVATION_TIME)
        control = ControlGiver(trial)
        control.wait_for_node()
        time.sleep(stimuli.OBSERVATION_TIME)
    control.drive(stimuli.FIRST_DRIVE, start=start)
    trial.observe(stimuli.AT_GOAL, stimuli.OBSERVATION_TIME)


def try_reset(trial):
    """Turn the robot, reset the node's frame, and give control for a second drive."""
    control = ControlGiver(trial)
    if not trial.node.is_alive:
        trial.node.start()
        trial.robot.leave_origin()
    time.sleep(0.3)
    trial.robot.turn_to(trial.recorder.heading_deg + stimuli.TURN_BEFORE_RESET_DEG)
    caller = ResetCaller(trial)
    if not caller.name:
        trial.skip_part([stimuli.RESET_TO_ORIGIN, stimuli.SECOND_DRIVE], OFFERS_NO_RESET)
    trial.add_remarks(caller.remarks())
    if _record_reset(trial, stimuli.RESET_TO_ORIGIN, caller):
        control.drive(stimuli.SECOND_DRIVE)
        _try_reset_in_drive(trial, control, caller)


def _record_reset(trial, name, caller, pose=Pose2(), seconds=stimuli.PRINT_AFTER_RESET_TIME,
                  has_driven_straight=True):
    """Call the reset service with `pose`, wait for `seconds` [s], and record both as the stimulus
    `name`. Returns False if the call failed."""
    facts = {WAS_MOVING: trial.recorder.node_moved_since(ros_time() - INTERRUPTION_TIME),
             stimuli.DROVE_STRAIGHT: has_driven_straight, stimuli.WRONG_NAME: caller.wrong_name}
    with trial.stimulus(name, facts) as stimulus:
        problem = caller.call_service(pose)
        stimulus.facts[stimuli.RESET_PROBLEM] = problem
        time.sleep(seconds)
    return not problem


def _try_reset_in_drive(trial, control, caller):
    """Reset the frame at the goal, turn the robot toward the new goal, and give control. In the
    middle of the drive, reset the frame again."""
    control.take_away()
    caller.call_service()
    trial.robot.turn_to(trial.recorder.heading_deg + stimuli.GOAL_BEARING_DEG)
    begin = ros_time()

    def has_driven_forward():
        return any(linear for _, linear, _ in trial.recorder.commands_since(begin))
    control.give()
    has_driven_straight = wait_until(has_driven_forward, stimuli.DRIVE_REACTION_TIME)
    time.sleep(INTERRUPTION_TIME)
    _record_reset(trial, stimuli.RESET_IN_DRIVE, caller, seconds=stimuli.TURN_TIME_IN_DRIVE,
                  has_driven_straight=has_driven_straight)
    control.take_away()


def try_taking_control(trial):
    """Take control away during a drive. Then send Ctrl+C during another drive."""
    control = ControlGiver(trial)
    was_moving = control.start_driving()
    trial.observe(stimuli.CONTROL_TAKEN, stimuli.OBSERVATION_TIME, control.take_away,
                  {WAS_MOVING: was_moving})
    trial.send_ctrl_c_in_motion(control.start_driving)
    control.take_away()


def try_declared_pose(trial):
    """Reset the frame to a pose that is not the origin and give control for a drive."""
    control = ControlGiver(trial)
    trial.node.start()
    caller = ResetCaller(trial)
    if not caller.takes_pose():
        reason = 'its reset takes no pose' if caller.name else OFFERS_NO_RESET
        trial.skip_part([stimuli.RESET_ELSEWHERE, stimuli.DECLARED_DRIVE], reason)
    if _record_reset(trial, stimuli.RESET_ELSEWHERE, caller, DECLARED_POSE):
        control.drive(stimuli.DECLARED_DRIVE, DECLARED_POSE)


def try_offset_imu(trial):
    """Turn the robot and reset its board. This reset sets the odometry to zero, but not the IMU, so
    that their zeros differ. Then give control for a drive."""
    control = ControlGiver(trial)
    trial.node.stop()
    board = rospy.Publisher(ODOMETRY_RESET_TOPIC, Empty, queue_size=1)
    wait_until(board.get_num_connections, 5.0)
    if not trial.robot.turn_to(100.0):     # [deg]
        trial.skip_part([stimuli.OFFSET_DRIVE],
                        'the robot did not come to rest, so that it could not be reset')
    board.publish()
    time.sleep(3.2)     # the board needs less time to calibrate itself
    trial.node.start()
    reset_to_origin(trial)
    control.drive(stimuli.OFFSET_DRIVE)
    control.take_away()


def try_lost_odometry(trial):
    """End the messages of the odometry during a drive."""
    control = ControlGiver(trial)
    trial.silence_sensor(stimuli.ODOMETRY_SILENT, control.start_driving(), ODOM_SWITCH)
    control.take_away()


PARTS = {stimuli.DRIVE: try_drive, stimuli.RESET: try_reset, stimuli.CONTROL: try_taking_control,
         stimuli.DECLARED: try_declared_pose, stimuli.OFFSET: try_offset_imu,
         stimuli.DEVICE_LOST: try_lost_odometry}
