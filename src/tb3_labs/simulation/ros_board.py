"""The topics and lines by which the board of a simulated robot reports its state.

Messages are those of turtlebot3_msgs, with the same checksums; the package need not be installed.
Lines go to /rosout, as rosserial's serial_node prints them. With several robots in one process,
each line begins with the robot's namespace. Sources: ROBOTIS OpenCR firmware 1.2.6
(turtlebot3_core.ino, turtlebot3_diagnosis.cpp); rosserial_python 0.9 (SerialClient.py).
"""
from functools import lru_cache

import rospy
from genpy.dynamic import generate_dynamic
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Header

from tb3_labs.robot.turtlebot3 import CUT_OFF
from tb3_labs.ros.rospy_internals import publish_now
from tb3_labs.simulation.firmware import encoder

CONSTANTS = ('BUMPER_FORWARD=1 BUMPER_BACKWARD=2 CLIFF=1 SONAR=1 ILLUMINATION=1 BUTTON0=1 '
             'BUTTON1=2 ERROR_LEFT_MOTOR=1 ERROR_RIGHT_MOTOR=2 TORQUE_ON=1 TORQUE_OFF=2')
FIELDS = ('Header header, uint8 bumper, float32 cliff, float32 sonar, float32 illumination, '
          'uint8 led, uint8 button, bool torque, int32 left_encoder, int32 right_encoder, '
          'float32 battery')
DEFINITIONS = {
    'SensorState': '\n'.join(
        ['uint8 ' + name for name in CONSTANTS.split()] + FIELDS.split(', ')
        + [80 * '=', 'MSG: std_msgs/Header', 'uint32 seq', 'time stamp', 'string frame_id', '']),
    'VersionInfo': 'string hardware\nstring firmware\nstring software\n'}
#: A firmware that was made for Melodic has another definition of BatteryState than Noetic.
CHECKSUM = ('Creation of publisher failed: Checksum does not match: '
            '4ddae7f048e32fda22cac764685e3974,476f837fa6771f6e16e3bf4ef96f8770')
NO_SYNC = ('Unable to sync with device; possible link problem or link software version mismatch '
           'such as hydro rosserial_python with groovy Arduino')
#: serial_node asks a board that does not answer again after this number of steps of the robot.
ASKS_AGAIN = 15 * 200


@lru_cache(maxsize=None)
def kind_of(name):
    """Returns the class of a message of turtlebot3_msgs: SensorState or VersionInfo."""
    full_name = 'turtlebot3_msgs/' + name
    return generate_dynamic(full_name, DEFINITIONS[name])[full_name]


class BoardTopics:
    """Publishes battery_state, sensor_state and firmware_version, with names after `prefix`."""

    def __init__(self, prefix, firmware):
        self._name = prefix.replace('/', ': ')
        self._version_due = 0.0
        self._state, self._version, self._battery = (
            rospy.Publisher(prefix + name, kind, queue_size=10) if kind else None
            for name, kind in (
                ('sensor_state', kind_of('SensorState')),
                ('firmware_version', kind_of('VersionInfo')),
                ('battery_state', BatteryState if firmware != 'melodic' else None)))
        if firmware == 'melodic':
            rospy.logerr('%s', self._name + CHECKSUM)

    def send(self, stamp, config, wheel_angles):
        """Publish the state at `stamp` [s] of a robot with these settings, with each odometry. If
        the motors have no power, their encoders do not answer, and sensor_state is not sent."""
        header, voltage = Header(stamp=rospy.Time.from_sec(stamp)), config.battery
        if self._battery and self._battery.get_num_connections():
            publish_now(self._battery, BatteryState(
                header=header, voltage=voltage, design_capacity=1.8, percentage=voltage / 11.1,
                present=voltage > 5.0))
        if self._state.get_num_connections() and voltage >= CUT_OFF:
            left, right = map(encoder, wheel_angles)
            publish_now(self._state, kind_of('SensorState')(
                header=header, torque=not config.motors_off, left_encoder=left,
                right_encoder=right, battery=voltage))
        if stamp >= self._version_due and self._version.get_num_connections():
            self._version_due = stamp + 1.0
            publish_now(self._version, kind_of('VersionInfo')(
                '2020.03.16', config.version, '2.0.0'))

    def say(self, lines):
        """Print lines of the board."""
        for line in lines:
            rospy.loginfo('%s', self._name + line)


class UnsyncedRobot:
    """A board with the firmware of ROS 2: serial_node asks for its topics, without an answer."""

    #: Does any node listen to its sensors?
    is_heard = False

    def __init__(self, namespace):
        self._name = namespace + ': ' if namespace else ''

    def configure(self, settings):
        """It has no settings."""

    def tick(self, step, epoch):
        """Let one step pass; `step` counts from 0."""
        if step % ASKS_AGAIN == 0:
            if step:
                rospy.logerr('%s', self._name + NO_SYNC)
            rospy.loginfo('%s', self._name + 'Requesting topics...')
