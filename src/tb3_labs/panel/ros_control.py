"""Carries out the requests of pages by sending messages to the nodes of the labs.

The panel publishes the pad of a page as `joy`, and the node `gamepad` decides what sticks and
buttons do. The panel publishes the mouse of a page as `mouse_info`, for the node `controller`. A
:class:`tb3_labs.supervision.dead_man.DeadMan` decides which page drives. A stop goes to all nodes.
"""
from functools import partial

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Float64

from tb3_labs.msg import MouseController
from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.panel.requests import BrowserPad
from tb3_labs.panel.ros_server import run_in_thread
from tb3_labs.panel.ros_subscriptions import RobotSubscriptions
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import frame_name, to_pose_stamped
from tb3_labs.ros.parameters import read_config
from tb3_labs.ros.reset_client import call_reset
from tb3_labs.ros.rospy_internals import subscribers_of
from tb3_labs.supervision.dead_man import DeadMan
from tb3_labs.supervision.timeouts import MAX_RESET_AGE

#: A request is refused after this delay [s], because the person no longer expects a motion.
MAX_REQUEST_AGE = 2.0
#: A stop is confirmed if the robot stands still within this time [s].
CONFIRM_TIMEOUT = 1.5
CONFIRM_PERIOD = 0.05       # [s]


class RobotControl:
    """Controls this namespace's robot. Only the thread `server` calls public methods."""

    def __init__(self, server):
        self._server = server
        self.dead_man = DeadMan()
        self._pad_config = PadConfig()
        self._is_mouse_active = False
        self._control_publisher = rospy.Publisher('ctrl_relinq', Bool, queue_size=20)
        self._joy_publisher = rospy.Publisher('joy', Joy, queue_size=20, tcp_nodelay=True)
        self._mouse_publisher = rospy.Publisher(
            'mouse_info', MouseController, queue_size=20, tcp_nodelay=True)
        self._turn_publisher = rospy.Publisher('turn', Float64, queue_size=5)
        self._goal_publisher = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=5)
        self._cmd_vel_publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        # threads of rospy receive the stops, and the thread `server` reacts to them
        self.subscriptions = RobotSubscriptions(partial(server.call_soon, self._on_stop))

    # -- pictures

    def picture(self, now):
        """Returns the picture of :mod:`tb3_labs.panel.robot_view`, without "page"."""
        picture = self.subscriptions.use_view(lambda view: view.picture(now))
        return dict(picture, stops=self.dead_man.stops, pad=self._pad_status())

    def _pad_status(self):
        """Returns 'ready', or the reason why the pad of a page does not drive."""
        if not subscribers_of(self._joy_publisher) - {rospy.get_name()}:
            return 'the node gamepad does not run'
        if self.subscriptions.has_another_pad:
            return 'another node publishes joy'
        holder = self.subscriptions.latest('holder')
        # the names of holders are texts here, because the students' archive has no ControlHolder
        if holder == 'move_to_goal':
            return 'move_to_goal has control: B takes it'
        # `holder` is None if the handout's gamepad runs, which does not publish control_holder
        is_ready = holder in ('gamepad', None)
        return 'ready' if is_ready else 'connecting: hold still'

    # -- requests

    def carry_out(self, page, request):
        """Carry out a request of `page`. Returns the answer as text. Returns None if another thread
        or a timer will answer. Raises ``ValueError`` with the reason if the request is refused."""
        return self._ACTIONS[request.type](self, page, request)

    def _drive_by_inputs(self, page, request):
        """Drive by the HeldInputs of `page`. Empty HeldInputs end the drive."""
        held = request.value
        if not held.pad and not held.mouse:
            if self.dead_man.let_go(page):
                self._release()
            return ''
        if held.mouse:
            self._require_listener(self._mouse_publisher, 'mouse_info: is the controller running?')
            self._refuse_during_drive()

        is_new_drive = self.dead_man.driving_page is None
        now = steady_time()
        lateness = request.lateness(now)
        may_drive = self.dead_man.hold(page, known_stops=request.known_stops, now=now,
                                       lateness=lateness, is_first=held.is_first)
        if not may_drive:
            return ''
        if is_new_drive:
            run_in_thread(self._read_pad_config)
        if held.pad:
            self._send_pad(held.pad, lateness)
        self._send_mouse(held.mouse)
        return ''

    def _stop_and_confirm(self, page, request):
        self.stop()
        self._confirm_stop(page, request, steady_time())

    def _send_turn(self, _page, request):
        self._refuse_if_old(request, MAX_REQUEST_AGE)
        self._require_listener(self._turn_publisher, 'turn: is the controller running?')
        self._refuse_during_drive()
        self._turn_publisher.publish(request.value)
        return f'asked for {request.value:g} degrees'

    def _send_goal(self, _page, request):
        self._refuse_if_old(request, MAX_REQUEST_AGE)
        self._require_listener(self._goal_publisher,
                               'move_base_simple/goal: is move_to_goal running?')
        typed = request.value
        self._goal_publisher.publish(
            to_pose_stamped(typed.pose, frame_name('local'), rospy.get_time()))
        return f'goal sent: {typed.x:.2f} m, {typed.y:.2f} m, {typed.yaw_deg:.0f} deg'

    def _reset(self, page, request):
        """Call the reset service in a separate thread, because the call may take a second."""
        self._refuse_if_old(request, MAX_RESET_AGE)    # the pose of an old reset may be wrong
        typed = request.value

        def reset_and_answer():
            try:
                outcome = True, call_reset(typed.x, typed.y, typed.yaw_deg)
            except Exception as error:    # the panel must go on, because it must stop robots
                outcome = False, str(error)
            self._server.call_soon(partial(page.answer, request, *outcome))
        run_in_thread(reset_and_answer)

    _ACTIONS = {'joy': _drive_by_inputs, 'stop': _stop_and_confirm, 'turn': _send_turn,
                'goal': _send_goal, 'reset': _reset}

    def _refuse_if_old(self, request, max_age):
        """Raises ``ValueError`` if `request` is possibly older than `max_age` [s]."""
        now = steady_time()
        self.dead_man.refuse_if_old(request.known_stops, now, request.lateness(now), max_age)

    @staticmethod
    def _require_listener(publisher, topic_and_advice):
        if not subscribers_of(publisher):
            raise ValueError('no node listens on ' + topic_and_advice)

    def _refuse_during_drive(self):
        if self.subscriptions.use_view(lambda view: view.is_driving):
            raise ValueError('move_to_goal drives: take control first')

    # -- stops

    def stop(self):
        """Stop the robot, whichever node drives."""
        self._control_publisher.publish(False)
        # B takes control through the handout's gamepad, which does not listen to ctrl_relinq
        self._send_pad(BrowserPad(b=True))
        # the controller ends a turn only if an active mouse becomes inactive, as in _release()
        self._send_mouse((0.0, 0.0))
        self._release()
        # a zero stops the robot if the driving node does not listen to ctrl_relinq
        self._cmd_vel_publisher.publish(Twist())
        self.dead_man.stop()

    def _on_stop(self):
        """Release pad and mouse, because another node stopped the robot."""
        if self.dead_man.driving_page is not None:
            self._release()
        self.dead_man.stop()

    def check_dead_man(self):
        """Stop the robot if the page that drives has been silent for too long."""
        silence = self.dead_man.driving_page_lost_for(steady_time())
        if silence:
            self.stop()
            rospy.logwarn('The page that drives is silent for %.1f s: the robot is stopped',
                          silence)

    def on_page_lost(self, page):
        """Stop the robot if `page` drives, because the connection to the page has ended."""
        if self.dead_man.driving_page is page:
            self.stop()

    def _confirm_stop(self, page, request, since):
        """Confirm the stop that `page` made at the time `since` [s] as soon as the robot stands
        still. After CONFIRM_TIMEOUT, answer why the stop cannot be confirmed."""
        listeners = (subscribers_of(self._control_publisher)
                     | subscribers_of(self._cmd_vel_publisher))
        if not listeners - {rospy.get_name()}:
            page.answer(request, is_fulfilled=False, text='no node hears it')
            return

        problem = self.subscriptions.use_view(lambda view: view.stop_problem(since))
        if not problem:
            is_control_known = self.subscriptions.latest('has_control') is not None
            text = 'control taken, the robot stands' if is_control_known else 'the robot stands'
            page.answer(request, is_fulfilled=True, text=text)
            return
        if steady_time() - since > CONFIRM_TIMEOUT:
            page.answer(request, is_fulfilled=False, text=problem)
            return
        look_again = partial(self._confirm_stop, page, request, since)
        self._server.call_later(CONFIRM_PERIOD, look_again)

    def _release(self):
        self._send_pad(BrowserPad())
        self._send_mouse(None)

    def _send_pad(self, pad, lateness=0.0):
        """Publish a BrowserPad as `joy`. `lateness` is the delay [s] of the page's message."""
        if self.subscriptions.has_another_pad:
            return    # the node gamepad would take the messages of both publishers for one pad
        axes, buttons = pad.as_joy(self._pad_config)
        message = Joy(axes=axes, buttons=buttons)
        message.header.stamp = rospy.Time.from_sec(max(0.0, rospy.get_time() - lateness))
        self._joy_publisher.publish(message)

    def _send_mouse(self, position):
        """Publish `mouse_info`. `position` is (x, y), or None if nobody holds the mouse. As in
        mouse_client.py, publish an inactive mouse before and after the active mouse."""
        is_active = position is not None
        if is_active != self._is_mouse_active:
            self._publish_mouse(is_active=False)
        self._is_mouse_active = is_active
        if is_active:
            x, y = position
            self._publish_mouse(is_active, x, y)

    def _publish_mouse(self, is_active, x=0.0, y=0.0):
        message = MouseController(status=Bool(is_active), xPos=x, yPos=y)
        message.header.stamp = rospy.Time.now()
        self._mouse_publisher.publish(message)

    def _read_pad_config(self):
        try:
            self._pad_config = read_config(PadConfig, other_node=rospy.resolve_name('gamepad'))
        except Exception as error:    # the panel must go on, because it must stop robots
            rospy.logwarn('the pad has the usual numbers: %s', error)
            self._pad_config = PadConfig()
