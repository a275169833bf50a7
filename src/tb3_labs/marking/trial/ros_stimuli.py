"""The robot of a trial, and the devices that the marker imitates, such as a mouse."""
import math
import threading
import time
from contextlib import AbstractContextManager, suppress

import rospy
from dynamic_reconfigure.encoding import decode_config, encode_config
from dynamic_reconfigure.msg import Config as ConfigMessage
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import Twist

from tb3_labs.geometry.angles import clamp, difference
from tb3_labs.handout import CMD_VEL_TOPIC
from tb3_labs.marking.trial.ros_recording import ROBOT_NODE
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.node import guarded

#: The settings of the robot that make a sensor silent.
IMU_SWITCH, ODOM_SWITCH = 'imu_silent', 'odom_silent'
STOP_REST_TIME = 2.0        # The robot rests within this time [s] after its last command.
INTERRUPTION_TIME = 0.5     # A movement lasts for this time [s] before a stimulus interrupts it.
MAX_HEADING_ERROR = 0.01    # [rad] at the end of a turn by the marker
DELIVERY_TIME = 0.3         # A node's output and messages reach the marker within this time [s].


class Robot:
    """Drives the simulated robot and changes its settings. Each movement by this class is recorded
    as a movement of the marker. If another program changes a setting of the robot, the change is
    recorded and undone."""

    def __init__(self, recorder):
        self._recorder = recorder
        self._settings = {}
        self._command_publisher = rospy.Publisher(CMD_VEL_TOPIC, Twist, queue_size=1)
        self._set_parameters = rospy.ServiceProxy(f'/{ROBOT_NODE}/set_parameters', Reconfigure)
        rospy.Subscriber(f'/{ROBOT_NODE}/parameter_updates', ConfigMessage,
                         guarded(self._on_settings))

    def _move(self, command, seconds):
        """Send the speeds (linear, angular) that ``command()`` returns, for `seconds` [s] or until
        ``command()`` returns None. At the end send a zero velocity, even after an exception."""
        begin = time.monotonic()
        try:
            speeds = command()
            while speeds is not None and time.monotonic() < begin + seconds:
                self._command_publisher.publish(to_twist(*speeds))
                time.sleep(0.03)    # a control period of the robot
                speeds = command()
        finally:
            self._command_publisher.publish(to_twist(0.0, 0.0))
            self._recorder.bag.add_event('own move', seconds=time.monotonic() - begin)

    def turn_to(self, heading_deg):
        """Turn the robot by at most 180 degrees to a heading [deg], within 8 s. Returns False if
        the robot does not come to rest."""
        def turn_toward_heading():
            error = difference(math.radians(heading_deg), self._recorder.pose.yaw)
            if abs(error) <= MAX_HEADING_ERROR:
                return None
            speed = clamp(3.0 * abs(error), 0.1, 1.5)   # [rad/s]
            return 0.0, math.copysign(speed, error)
        self._move(turn_toward_heading, 8.0)
        return wait_until(self._recorder.is_at_rest, STOP_REST_TIME)

    def leave_origin(self):
        """Drive the robot away from the odometry's origin, where a wrong frame may look right."""
        self._move(lambda: (0.2, 0.0), 2.5)

    def change_settings(self, **settings):
        if self._settings:      # `_on_settings` must accept the change
            self._settings.update(settings)
        self._set_parameters(encode_config(settings))

    def _on_settings(self, message):
        current = decode_config(message)
        if not self._settings:
            self._settings = current
        changed = {name for name, _ in self._settings.items() ^ current.items()}
        if changed:
            names = ', '.join(sorted(changed))
            self._recorder.bag.add_event(
                'finding', text=f'Settings of the robot were changed, and set back: {names}.')
            with suppress(rospy.ServiceException):      # the robot has ended
                self._set_parameters(encode_config(self._settings))


class Repeater(AbstractContextManager):
    """Repeats a message until the end of a ``with`` block, as the driver of a mouse does."""

    def __init__(self, topic, message_class):
        self._message = None
        self._is_closed = False
        self._publisher = rospy.Publisher(topic, message_class, queue_size=1, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def __exit__(self, *exception):
        self._message = None
        self._is_closed = True

    def hold(self, message):
        """Send the message now and repeat it. ``hold(None)`` ends the messages, as if the device
        were unplugged."""
        self._message = message
        self._send_held()

    def wait_for_subscriber(self):
        """Wait until a node is connected, and 0.45 s longer. A node may ignore a new gamepad until
        its sticks have been at rest for a moment. In this package's node this moment is 0.3 s."""
        wait_until(self._publisher.get_num_connections, 1.0)
        time.sleep(0.45)

    def send(self, message):
        """Publish a message. A subclass may stamp the message first."""
        self._publisher.publish(message)

    def _send_held(self):
        message = self._message
        if message is not None:
            self.send(message)

    def _repeat(self):
        while not (self._is_closed or rospy.is_shutdown()):
            self._send_held()
            time.sleep(0.05)
