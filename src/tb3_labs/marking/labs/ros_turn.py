"""The scripts of the IMU lab: what the marker does to a node of the exercise, and of the turns."""
import math
import time
from contextlib import suppress

import rospy
from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool as BoolMessage
from std_msgs.msg import Header

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.handout import LEFT_KEY, MOUSE_INFO
from tb3_labs.marking.labs import imu as imu_lab
from tb3_labs.marking.labs import turn as turn_lab
from tb3_labs.marking.labs.criteria import LOST
from tb3_labs.marking.trial.observation import REQUESTED_DEG, WAS_MOVING, NotOffered
from tb3_labs.marking.trial.ros_stimuli import IMU_SWITCH, WELL_UNDER_WAY, Repeater
from tb3_labs.marking.trial.ros_student_node import LISTENS
from tb3_labs.msg import MouseController
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_quaternion

#: The topic of the marker's own IMU, to which the node's topic imu is remapped.
MARKERS_IMU = 'probe/imu'
#: Each odd sample is repeated for this time [s].
ODD = 0.6
#: Headings a hair below zero [rad].
HAIRS = (-1e-17, -1e-12, math.radians(-1e-8))
#: A turn is over if the node has commanded no movement for this time [s].
QUIET_AFTER = 0.4


def exercise(trial):
    """Turn the robot to several headings, let it stand at each heading, then send Ctrl+C."""
    node = trial.node
    offset = rospy.get_param('/turtlebot3/imu_offset_deg')      # before a node can change it
    node.start()
    for name, degrees in imu_lab.STANDS.items():
        trial.robot.face(degrees - offset)
        heading = (trial.recorder.heading_deg + offset) % 360.0
        with trial.stimulus(name, {imu_lab.HEADING_DEG: heading}):
            wait_until(lambda: not node.alive or len(imu_lab.headings(node.printed)) > 2,
                       imu_lab.READING)
    trial.ctrl_c()


def odd_samples(trial):
    """Send samples that a robot's IMU seldom sends, by the marker's own IMU."""
    trial.node.start('imu:=' + MARKERS_IMU, listens=[MARKERS_IMU])
    with Repeater(MARKERS_IMU, Imu) as sensor:
        def send(orientation, seconds):
            sensor.hold(Imu(orientation=orientation))
            time.sleep(seconds)
        with trial.stimulus(imu_lab.HAIR_BELOW_ZERO):
            for yaw in HAIRS:
                send(to_quaternion(yaw), ODD)
        with trial.stimulus(imu_lab.ZERO_QUATERNION):
            send(Quaternion(), ODD)
            send(to_quaternion(math.radians(imu_lab.AFTERWARDS)), imu_lab.NEXT)
    trial.node.stop()


# ----- the lab -----

class HeldMouse(Repeater):
    """The marker's mouse on the topic mouse_info, by the message type of the node.

    ValueError if this type has no fields for a mouse. `up` is the sign of y above the middle,
    `package` the package of the type. `remarks` are sentences about fields whose names are not
    those of the mouse lab.
    """

    def __init__(self, graph, recording):
        self.up, self._recording, self._last_sent = 1, recording, None
        self._kind = graph.kind_of(MOUSE_INFO) or graph.types.message(MouseController._type)
        self.package = self._kind._type.split('/')[0]
        self._names, self.remarks = mouse_fields(self._kind.fields)
        super().__init__(MOUSE_INFO, self._kind)

    def at(self, x, y, active=True, seconds=0.0):
        """Hold the mouse at a place from now on, and wait for `seconds` [s]. x is to the right, y
        up, both from -1 to 1."""
        message = self._kind()
        for name, value in zip(self._names, (active, x, self.up * y)):
            message.put(name, value)
        self._last_sent = BoolMessage(active), x, y
        self.hold(message)
        time.sleep(seconds)

    def send(self, message):
        # a node may take a repeated stamp for a driver that hangs
        now = rospy.Time.now()
        for name, of, _ in message.fields:
            if of == 'std_msgs/Header':
                message.put(name, now.secs, now.nsecs)
        super().send(message)
        self._recording.add(MOUSE_INFO, MouseController(Header(stamp=now), *self._last_sent))


#: The names of the fields in the mouse lab, and the types that such a field may have.
STATUS, X, Y = 'status', 'xPos', 'yPos'
FLAGS = ('bool', 'std_msgs/Bool')
NUMBERS = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


def mouse_fields(fields):
    """Returns ([names of status, x and y], sentences about names that differ from the mouse lab's)
    of a message type, by its `fields`: rows of name, type, place. The three are found by name, else
    by type and order.

    Raises ``ValueError`` with a clause if the type has no flag, or fewer than two numbers.
    """
    flags = [name for name, of, *_ in fields if of in FLAGS]
    numbers = [name for name, of, *_ in fields if of in NUMBERS]
    if not flags or len(numbers) < 2:
        known = ', '.join(f'{of} {name}' for name, of, *_ in fields)
        raise ValueError(f"its message has no flag and two numbers, but {known or 'no field'}")
    places = [_named(X, numbers), _named(Y, numbers)]
    chosen = [_named(STATUS, flags) or flags[0]] + (places if all(places) else numbers[:2])
    return chosen, [f'Your {name} was taken for {usual}.'
                    for name, usual in zip(chosen, (STATUS, X, Y)) if name != usual]


def _named(usual, names):
    """Returns the name that equals `usual` but for capitals, `_` and `Pos`; '' if there is none."""
    bare = {name.lower().replace('_', ''): name for name in reversed(names)}
    return bare.get(usual.lower()) or bare.get(usual.lower().replace('pos', ''), '')


def mouse_of(trial, names):
    """Returns a HeldMouse, inactive in the middle. If the node has no topic for a mouse, the
    stimuli `names` are not offered, which ends the part."""
    if rospy.resolve_name(MOUSE_INFO) not in trial.node.graph.of_node(LISTENS):
        trial.not_offered(names, 'it does not listen to mouse_info')
    try:
        mouse = HeldMouse(trial.node.graph, trial.recording)
    except ValueError as problem:
        trial.not_offered(names, str(problem))
    trial.remark(mouse.remarks)
    up = trial.text(mouse.package)['up']
    trial.recording.event('mouse client', up=up)
    mouse.up = up or 1
    mouse.at(0.0, 0.0, active=False)
    mouse.wait_for_subscriber()
    return mouse


def turns(trial):
    """Try six turns, each from its own heading even if the turn before failed, then an invalid
    input."""
    for name, turn in turn_lab.TURN_STIMULI.items():
        trial.set_slip(turn.slip)
        _begin_at(trial, turn.begins_deg)
        _try_turn(trial, name, turn.typed, {REQUESTED_DEG: turn.requested_deg})
    _begin_at(trial, 40.0)      # where the last turn ends
    trial.watch(turn_lab.NONSENSE, turn_lab.ANSWER,
                lambda: trial.node.type(turn_lab.TYPED_NONSENSE))


def _begin_at(trial, heading):
    """Turn the robot near this heading [deg] and start the node, if this is needed."""
    astray = abs(difference_degrees(trial.recorder.heading_deg, heading)) > 25.0   # [deg]
    if astray or not (trial.node.alive and trial.recorder.rests()):
        trial.node.stop()
        if astray:
            trial.robot.face(heading)
        trial.node.start()


def _try_turn(trial, name, typed, facts=(), seconds=turn_lab.TURN_TIME):
    """Try a turn by the letter `typed`, and record it as the stimulus `name` with these `facts`."""
    trial.motion(name, lambda: trial.node.type(typed), turn_lab.TURN_REACTION, QUIET_AFTER,
                 seconds, facts)


def mouse(trial):
    """Try the mouse alone, before any letter is typed."""
    trial.node.start()
    with mouse_of(trial, turn_lab.MOUSE_ALONE) as hand:
        trial.watch(turn_lab.NOT_ACTIVE, turn_lab.MOUSE_HELD,
                    lambda: hand.at(0.0, 1.0, active=False))
        hand.at(0.0, 0.0, seconds=0.2)
        for name, place in turn_lab.MOUSE_PLACES.items():
            trial.watch(name, turn_lab.MOUSE_HELD, lambda: hand.at(*place))
        hand.at(0.0, 1.0, seconds=0.4)
        trial.watch(turn_lab.DEACTIVATED, 1.0, lambda: hand.at(0.0, 1.0, active=False))


def both(trial):
    """Try a turn while the mouse is active, then the mouse after a turn, and in a turn."""
    if not _is_idle(trial):
        trial.node.start()
    with mouse_of(trial, turn_lab.BESIDE_TURNS) as hand:
        hand.at(0.0, 0.0, seconds=0.3)
        _try_turn(trial, turn_lab.TURN_BESIDE, LEFT_KEY, seconds=turn_lab.BESIDE_TIME)
        trial.watch(turn_lab.AFTER_TURN, turn_lab.MOUSE_HELD, lambda: hand.at(0.0, 1.0))
        hand.at(0.0, 0.0)
        wait_until(trial.recorder.rests, 2.0)
        moving = trial.moves_after(lambda: trial.node.type(LEFT_KEY), turn_lab.TURN_REACTION)
        time.sleep(WELL_UNDER_WAY)
        with trial.stimulus(turn_lab.IN_TURN, {WAS_MOVING: moving}) as record:
            hand.at(0.0, 1.0)
            wait_until(lambda: turn_lab.any_full_speed(
                trial.recorder.commands_since(record.begin), 1.0, -1.0), turn_lab.AT_LAST)
        hand.at(0.0, 0.0, active=False, seconds=0.2)


def _is_idle(trial):
    return trial.node.alive and wait_until(lambda: trial.recorder.rests(QUIET_AFTER), 1.0)


def _in_a_turn(trial):
    return trial.set_in_motion(lambda: _is_idle(trial), lambda: trial.node.type(LEFT_KEY),
                               turn_lab.TURN_REACTION)


def lost(trial):
    """Let the mouse fall silent in a drive, and the IMU in a turn."""
    trial.node.start()
    with suppress(NotOffered), mouse_of(trial, [turn_lab.MOUSE_SILENT]) as hand:
        hand.at(0.0, 0.0, seconds=0.3)
        moving = trial.moves_after(lambda: hand.at(0.0, 1.0), 0.5)
        time.sleep(WELL_UNDER_WAY)
        trial.falls_silent(turn_lab.MOUSE_SILENT, moving, lambda: hand.hold(None))
        hand.at(0.0, 0.0, active=False, seconds=0.3)
    trial.sensor_falls_silent(turn_lab.IMU_SILENT, _in_a_turn(trial), IMU_SWITCH)


EXERCISE_PARTS = {imu_lab.HEADING: exercise, imu_lab.ODD_SAMPLES: odd_samples}
PARTS = {turn_lab.TURNS: turns, turn_lab.MOUSE: mouse, turn_lab.BOTH: both,
         turn_lab.SHUTDOWN: lambda trial: trial.ctrl_c_in_motion(lambda: _in_a_turn(trial)),
         LOST: lost}
