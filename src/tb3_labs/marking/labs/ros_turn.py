"""Scripts for the trials of the IMU exercise and of the IMU lab."""
import math
import time
from contextlib import suppress
from functools import partial

import rospy
from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Header

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.handout import LEFT_KEY, MOUSE_INFO_TOPIC
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.imu import headings_in_text
from tb3_labs.marking.labs.turn import MIN_EDGE_SPEED
from tb3_labs.marking.trial.observation import REQUESTED_DEG, WAS_MOVING, NotOffered
from tb3_labs.marking.trial.ros_stimuli import IMU_SWITCH, INTERRUPTION_TIME, Repeater
from tb3_labs.marking.trial.ros_student_node import SUBSCRIBER
from tb3_labs.msg import MouseController
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_quaternion

#: The marker remaps the node's topic imu to this topic, on which it publishes samples of its own.
MARKER_IMU_TOPIC = 'probe/imu'
ENOUGH_HEADINGS = 3     # If the node has printed so many headings, the marker turns the robot.
ODD_SAMPLE_TIME = 0.6           # [s]
YAWS_BELOW_ZERO = (-1e-17, -1e-12, math.radians(-1e-8))     # [rad]
#: A turn is over if the robot rests, and if the node has commanded no movement for this time [s].
TURN_IDLE_TIME = 0.4
MAX_START_ERROR_DEG = 25.0      # A turn may begin at a heading so far from the intended one.


def stand_at_headings(trial):
    """Let the robot stand at several headings. Then send Ctrl+C."""
    node = trial.node
    offset = rospy.get_param('/turtlebot3/imu_offset_deg')    # a node can change it later
    node.start()
    for name, degrees in stimuli.STANDING_HEADINGS.items():
        trial.robot.turn_to(degrees - offset)
        heading = (trial.recorder.heading_deg + offset) % 360.0
        with trial.stimulus(name, {stimuli.HEADING_DEG: heading}):
            wait_until(
                lambda: not node.is_alive or len(headings_in_text(node.printed)) >= ENOUGH_HEADINGS,
                stimuli.READING_TIME)
    trial.send_ctrl_c()


def send_odd_samples(trial):
    """Publish samples in place of the IMU. A real IMU seldom sends such samples."""
    trial.node.start('imu:=' + MARKER_IMU_TOPIC, needed_topics=[MARKER_IMU_TOPIC])
    with Repeater(MARKER_IMU_TOPIC, Imu) as sensor:
        def hold_orientation(orientation, seconds):
            sensor.hold(Imu(orientation=orientation))
            time.sleep(seconds)
        with trial.stimulus(stimuli.JUST_BELOW_ZERO):
            for yaw in YAWS_BELOW_ZERO:
                hold_orientation(to_quaternion(yaw), ODD_SAMPLE_TIME)
        with trial.stimulus(stimuli.ZERO_QUATERNION):
            hold_orientation(Quaternion(), ODD_SAMPLE_TIME)
            hold_orientation(to_quaternion(math.radians(stimuli.VALID_HEADING_DEG)),
                             stimuli.VALID_HEADING_TIME)
    trial.node.stop()


# ----- the lab -----

class HeldMouse(Repeater):
    """The mouse that the marker imitates."""

    def __init__(self, message_class, field_names, y_sign, bag):
        """`field_names` are the fields for status, x and y. `y_sign` is the sign of y in the upper
        half of the screen."""
        self._message_class = message_class
        self._field_names = field_names
        self._y_sign = y_sign
        self._bag = bag
        self._last_sent = None
        super().__init__(MOUSE_INFO_TOPIC, message_class)

    def hold_at(self, x, y, active=True, seconds=0.0):
        """Move the mouse to (x, y), hold it there, and wait for `seconds` [s]. x is positive to the
        right, y is positive upward, and both are from -1 to 1."""
        message = self._message_class()
        for name, value in zip(self._field_names, (active, x, self._y_sign * y)):
            message.put(name, value)
        self._last_sent = Bool(active), x, y
        self.hold(message)
        time.sleep(seconds)

    def send(self, message):
        # a node may reject a repeated stamp, so each message has a new stamp
        now = rospy.Time.now()
        for name, type_name, _ in message.fields:
            if type_name == 'std_msgs/Header':
                message.put(name, now.secs, now.nsecs)
        super().send(message)
        self._bag.add(MOUSE_INFO_TOPIC, MouseController(Header(stamp=now), *self._last_sent))


USUAL_FIELDS = ('status', 'xPos', 'yPos')      # for status, x and y in the mouse lab
FLAG_TYPES = ('bool', 'std_msgs/Bool')
NUMBER_TYPES = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


def mouse_fields(fields):
    """Returns the names of the fields for status, x and y, and a sentence on each name that differs
    from the name in the mouse lab. `fields` is a list of (name, type, ...).

    The fields for x and y are the first numbers whose names begin with x and y. If no name begins
    with x, or no name begins with y, the fields for x and y are the first two numbers. Raises
    ``ValueError`` with a clause if the message has no flag, or fewer than two numbers.
    """
    flags = [name for name, type_name, *_ in fields if type_name in FLAG_TYPES]
    numbers = [name for name, type_name, *_ in fields if type_name in NUMBER_TYPES]
    if not flags or len(numbers) < 2:
        found = ', '.join(f'{type_name} {name}' for name, type_name, *_ in fields) or 'no field'
        raise ValueError(f'its message has no flag and two numbers, but {found}')
    x_names = [name for name in numbers if name.lower().startswith('x')]
    y_names = [name for name in numbers if name.lower().startswith('y')]
    x_and_y = [x_names[0], y_names[0]] if x_names and y_names else numbers[:2]
    usual_status, _, _ = USUAL_FIELDS
    field_names = [usual_status if usual_status in flags else flags[0], *x_and_y]
    remarks = [f'Your {name} was taken for {usual}.'
               for name, usual in zip(field_names, USUAL_FIELDS) if name != usual]
    return field_names, remarks


def start_mouse(trial, names):
    """Returns a HeldMouse, inactive and in the middle, with the type that the node uses on
    mouse_info. If this type is not suitable, ends the part, and the stimuli `names` are skipped."""
    graph = trial.node.graph
    if rospy.resolve_name(MOUSE_INFO_TOPIC) not in graph.names_by_role()[SUBSCRIBER]:
        trial.skip_part(names, 'it does not listen to mouse_info')
    message_class = graph.message_class(MOUSE_INFO_TOPIC)
    if message_class is None:
        message_class = graph.types.message_class(MouseController._type)
    try:
        field_names, remarks = mouse_fields(message_class.fields)
    except ValueError as error:
        trial.skip_part(names, str(error))
    trial.add_remarks(remarks)
    package = message_class._type.split('/')[0]
    client_y_sign = trial.source_findings(package)['mouse_y_sign']
    trial.bag.add_event('mouse client', up=client_y_sign)
    y_sign = -1 if client_y_sign < 0 else 1
    mouse = HeldMouse(message_class, field_names, y_sign, trial.bag)
    mouse.hold_at(0.0, 0.0, active=False)
    mouse.wait_for_subscriber()
    return mouse


def try_turns(trial):
    """Ask for six turns, then type an invalid input. Each turn begins at its own heading, even if
    the previous turn failed."""
    for name, turn in stimuli.TURN_STIMULI.items():
        trial.set_slip(turn.slip)
        _begin_at(trial, turn.begins_deg)
        _try_turn(trial, name, turn.typed, {REQUESTED_DEG: turn.requested_deg})
    _begin_at(trial, 40.0)      # a correct node ended the previous turn at this heading [deg]
    trial.observe(stimuli.NONSENSE, stimuli.ANSWER_TIME,
                  partial(trial.node.type, stimuli.TYPED_NONSENSE))


def _begin_at(trial, heading_deg):
    """Make sure that the robot rests near the heading, and that the node runs."""
    error_deg = wrap_all(trial.recorder.heading_deg - heading_deg, 360.0)
    is_near = abs(error_deg) <= MAX_START_ERROR_DEG
    is_idle = trial.node.is_alive and trial.recorder.is_at_rest()
    if is_near and is_idle:
        return
    trial.node.stop()
    if not is_near:
        trial.robot.turn_to(heading_deg)
    trial.node.start()


def _try_turn(trial, name, typed, facts=(), seconds=stimuli.MAX_TURN_TIME):
    trial.record_motion(
        name, partial(trial.node.type, typed), reaction_time=stimuli.TURN_REACTION_TIME,
        idle_time=TURN_IDLE_TIME, max_duration=seconds, facts=facts)


def try_mouse(trial):
    """Move the mouse before any letter is typed."""
    trial.node.start()
    with start_mouse(trial, stimuli.MOUSE_ALONE) as mouse:
        hold_inactive = partial(mouse.hold_at, 0.0, 1.0, active=False)
        trial.observe(stimuli.MOUSE_NOT_ACTIVE, stimuli.MOUSE_HOLD_TIME, hold_inactive)
        mouse.hold_at(0.0, 0.0, seconds=0.2)
        for name, place in stimuli.MOUSE_POSITIONS.items():
            trial.observe(name, stimuli.MOUSE_HOLD_TIME, partial(mouse.hold_at, *place))
        mouse.hold_at(0.0, 1.0, seconds=0.4)
        trial.observe(stimuli.MOUSE_DEACTIVATED, 1.0, hold_inactive)


def try_mouse_with_turns(trial):
    """Ask for a turn while the mouse is active. Move the mouse after the turn, and also during
    another turn."""
    if not _wait_until_idle(trial):
        trial.node.start()
    with start_mouse(trial, stimuli.BESIDE_TURNS) as mouse:
        mouse.hold_at(0.0, 0.0, seconds=0.3)
        _try_turn(trial, stimuli.TURN_BESIDE_MOUSE, LEFT_KEY, seconds=stimuli.BESIDE_MOUSE_TIME)
        trial.observe(stimuli.MOUSE_AFTER_TURN, stimuli.MOUSE_HOLD_TIME,
                      partial(mouse.hold_at, 0.0, 1.0))
        mouse.hold_at(0.0, 0.0)
        wait_until(trial.recorder.is_at_rest, 2.0)
        was_moving = trial.act_and_await_motion(
            partial(trial.node.type, LEFT_KEY), stimuli.TURN_REACTION_TIME)
        time.sleep(INTERRUPTION_TIME)
        with trial.stimulus(stimuli.MOUSE_IN_TURN, {WAS_MOVING: was_moving}) as stimulus:
            def has_driven():
                commands = trial.recorder.commands_since(stimulus.begin)
                return any(abs(linear) > MIN_EDGE_SPEED for _, linear, _ in commands)
            mouse.hold_at(0.0, 1.0)
            wait_until(has_driven, stimuli.MOUSE_REACTION_TIME)
        mouse.hold_at(0.0, 0.0, active=False, seconds=0.2)


def _wait_until_idle(trial):
    return trial.node.is_alive and wait_until(
        lambda: trial.recorder.is_at_rest(TURN_IDLE_TIME), 1.0)


def _set_turning(trial):
    return trial.set_in_motion(partial(_wait_until_idle, trial), partial(trial.node.type, LEFT_KEY),
                               stimuli.TURN_REACTION_TIME)


def send_ctrl_c_in_turn(trial):
    trial.send_ctrl_c_in_motion(partial(_set_turning, trial))


def try_lost_devices(trial):
    """End the messages of the mouse during a drive. Then end the messages of the IMU during a
    turn."""
    trial.node.start()
    with suppress(NotOffered), start_mouse(trial, [stimuli.MOUSE_SILENT]) as mouse:
        mouse.hold_at(0.0, 0.0, seconds=0.3)
        was_moving = trial.act_and_await_motion(partial(mouse.hold_at, 0.0, 1.0), 0.5)
        time.sleep(INTERRUPTION_TIME)
        trial.silence_device(stimuli.MOUSE_SILENT, was_moving, partial(mouse.hold, None))
        mouse.hold_at(0.0, 0.0, active=False, seconds=0.3)
    trial.silence_sensor(stimuli.IMU_SILENT, _set_turning(trial), IMU_SWITCH)


EXERCISE_PARTS = {stimuli.HEADING: stand_at_headings, stimuli.ODD_SAMPLES: send_odd_samples}
PARTS = {stimuli.TURNS: try_turns, stimuli.MOUSE: try_mouse,
         stimuli.MOUSE_AND_TURNS: try_mouse_with_turns, stimuli.SHUTDOWN: send_ctrl_c_in_turn,
         stimuli.DEVICE_LOST: try_lost_devices}
