"""One robot as pages see and drive it: requests of pages become messages to its nodes.

A page gives control to move_to_goal in three steps: the request "give" arrives in `carry_out`,
:class:`tb3_labs.panel.holder.Holder` decides whether it counts, and `flush` publishes the messages
of the holder.
"""
import threading

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Float64

from tb3_labs.msg import MouseController
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.holder import LONGEST_DELAY, Holder
from tb3_labs.panel.ros_watch import Watch
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.control_and_reset import ControlGiver, call_reset
from tb3_labs.ros.conversions import frame, to_pose_stamped
from tb3_labs.ros.node import guarded, read_config
from tb3_labs.ros.rospy_internals import heard_by, messages_written

#: A pad of another node is in use if its `joy` was heard within this time [s].
OTHER_PAD = 0.5
#: If no node publishes `control_holder`, a page's pad counts as ready after this time [s].
PAD_IS_HEARD = 0.5
#: Requests that count even if they come late.
STOPS = ('stop', 'take', 'let go', 'joy')
#: A stop is confirmed if it is written within this time [s].
CONFIRM_WITHIN = 0.5
#: A stop that is not confirmed yet is checked once in this time [s].
CONFIRM_PERIOD = 0.005


class Senders:
    """The publishers of one robot; `prefix` is the robot's namespace with a slash, or ''.

    Only the constructor and :meth:`read_pad_numbers` wait for the master.
    """

    def __init__(self, prefix):
        self._prefix = prefix
        self._pad_config = PadConfig()
        #: The publisher of `ctrl_relinq`.
        self.control = ControlGiver(prefix)
        # these nodes listen to the same topics, but a stop is not for them
        self._others = {rospy.get_name()} | {
            rospy.resolve_name(prefix + name) for name in ('gamepad', 'controller')}
        self._is_first = True            # no message on ctrl_relinq was sent yet
        self._joy = rospy.Publisher(prefix + 'joy', Joy, queue_size=20, tcp_nodelay=True)
        self._mouse = rospy.Publisher(prefix + 'mouse_info', MouseController, queue_size=20,
                                      tcp_nodelay=True)
        self.turn = rospy.Publisher(prefix + 'turn', Float64, queue_size=5)
        self._goal = rospy.Publisher(prefix + 'move_base_simple/goal', PoseStamped, queue_size=5)
        self.cmd_vel = rospy.Publisher(prefix + 'cmd_vel', Twist, queue_size=1, tcp_nodelay=True)

    def heard(self):
        """Returns {a request of a page: does any node listen to it?}"""
        control, goal = self.takers, heard_by(self._goal)
        return {'goal': bool(goal), 'reset': bool(goal or control), 'control': bool(control),
                'turn': bool(heard_by(self.turn)), 'mouse': bool(heard_by(self._mouse)),
                'pad': bool(heard_by(self._joy) - {rospy.get_name()})}

    @property
    def takers(self):
        """Names of the nodes from which control can be taken."""
        return self.control.takers - self._others

    @property
    def stoppable(self):
        """Names of the nodes that hear a stop: the `takers`, and the nodes of the robot."""
        return self.takers | heard_by(self.cmd_vel) - self._others

    def stops_written(self):
        """Returns {connection: number of messages written to it}, of those that carry a stop."""
        return {**self.control.written, **messages_written(self.cmd_vel)}

    def grant(self, granted, now):
        """True gives control to move_to_goal, False takes it; `now` in [s], steady."""
        if granted and self._is_first:
            # False comes first, as from a gamepad. If a panel is started again under its old name,
            # a first True would count as a True of the earlier panel.
            self.control.say(False, now)
        self._is_first = False
        self.control.say(granted, now)

    def read_pad_numbers(self):
        """Learn the numbers of axes and buttons that the node gamepad uses now."""
        try:
            self._pad_config = read_config(PadConfig, of=rospy.resolve_name(
                self._prefix + 'gamepad'))
        except ValueError as problem:    # gamepad has rejected its own numbers, and ended
            rospy.logwarn('the pad has the usual numbers: %s', problem)
            self._pad_config = PadConfig()

    def pad(self, late_pad):
        """Publish a panel.holder.LatePad as `joy`, as the package joy does."""
        axes, buttons = late_pad.pad.as_joy(self._pad_config)
        message = Joy(axes=axes, buttons=buttons)
        message.header.stamp = rospy.Time.from_sec(
            max(0.0, rospy.get_time() - late_pad.lateness))
        self._joy.publish(message)

    def mouse(self, state):
        """Publish a panel.holder.MouseState as `mouse_info`, as mouse_client.py does."""
        message = MouseController(status=Bool(state.active), xPos=state.x, yPos=state.y)
        message.header.stamp = rospy.Time.now()
        self._mouse.publish(message)

    def goal(self, place):
        """Send a goal, a geometry.se2.TypedPose."""
        self._goal.publish(to_pose_stamped(place.pose, frame(self._prefix + 'local'),
                                           rospy.get_time()))


class PanelRobot:
    """The robot in namespace `name` ('': this node's own); with `control` it can be driven.

    Only the thread of the `server` calls these methods. They do not wait for the master; the
    `worker` does.
    """

    def __init__(self, name, control, server, worker):
        self.name = name
        self.holder = Holder()
        self._prefix = name + '/' if name else ''
        self._server, self._worker = server, worker
        #: Hears the robot's topics.
        self.watch = Watch(self._prefix, self._tell_holder)
        # made at the start, so that a stop does not need the master
        self._senders = Senders(self._prefix) if control else None

    def look(self, level):
        """Listen to the topics of `level` (one of Watch), soon."""
        self._worker.put(lambda: self.watch.look(level))

    def picture(self, now):
        """The picture, with the requests that have a listener."""
        # no request is offered that could move the robot until the stops of others are heard
        heard = {kind: heard and self.watch.hears_all
                 for kind, heard in self._senders.heard().items()} if self._senders else {}
        return dict(self.watch.read(lambda view: view.picture(now)), can=heard,
                    pad=self._pad_words(heard, now))

    def carry_out(self, page, request):
        """Do what `page` asks for in a Request with known times. Returns the answer in words, or
        None if it comes later. ``ValueError`` with the reason if the request is rejected."""
        now = steady_time()
        if now - request.pressed > LONGEST_DELAY and request.kind not in STOPS:
            raise ValueError('this came {:.1f} s late, and does not count: ask again'.format(
                now - request.pressed))
        return self._ACTIONS[request.kind](self, page, request, now)

    def flush(self, now):
        """Publish the messages of the holder."""
        if self._senders is None:
            return
        grants, pads, mouse_states = self.holder.take_messages()
        for granted in grants:
            self._senders.grant(granted, now)
        for pad in pads:
            if not self._other_pad(now):
                self._senders.pad(pad)
        for state in mouse_states:
            self._senders.mouse(state)

    # -- the actions

    def _begin(self, page, request, now):
        self.holder.begin(page, now, request.pressed)
        self._worker.put(self._senders.read_pad_numbers)
        return ''

    def _joy(self, page, request, now):
        self.holder.on_joy(page, request.value, now, request.lateness, not self._is_driving(),
                           request.pressed)
        if self.holder.has_granted:
            self._senders.control.renew(now)
        return ''

    def _let_go(self, page, _request, _now):
        self.holder.let_go(page)
        return ''

    def _give(self, page, request, now):
        if not self._senders.takers:
            raise ValueError('no node listens on ctrl_relinq: is move_to_goal running?')
        self.holder.give(page, now, request.pressed)
        return 'control given'

    def _take(self, page, request, now):
        senders = self._senders
        confirm = self._confirmation(page, request, senders.takers,
                                     lambda: senders.control.written, 'control taken')
        self.holder.take(page, now, request.pressed)
        self.flush(now)
        confirm()

    def _stop(self, page, request, now):
        senders = self._senders
        confirm = self._confirmation(page, request, senders.stoppable, senders.stops_written,
                                     'STOP was sent to {}')
        self.holder.stop(page, now, request.pressed)
        self.flush(now)
        senders.cmd_vel.publish(Twist())    # for a robot that is driven by a simple node
        confirm()

    def _turn(self, page, request, _now):
        if not self._senders.heard()['turn']:
            raise ValueError('no node listens on turn: is the controller running?')
        if self._is_driving():
            raise ValueError('move_to_goal drives: take control first')
        self.holder.check(page, request.pressed)
        self._senders.turn.publish(request.value)
        return 'asked for {:g} degrees'.format(request.value)

    def _goal(self, page, request, _now):
        if not self._senders.heard()['goal']:
            raise ValueError('no node listens on move_base_simple/goal: is move_to_goal running?')
        self.holder.check(page, request.pressed)
        self._senders.goal(request.value)
        return 'goal sent: {0.x:.2f} m, {0.y:.2f} m, {0.yaw_deg:.0f} deg'.format(request.value)

    def _reset(self, page, request, _now):
        """Call the service in a thread of its own: it may take a second."""
        place = request.value

        def call():
            try:
                fulfilled, text = True, call_reset(place.x, place.y, place.yaw_deg, self._prefix)
            except ValueError as problem:
                fulfilled, text = False, str(problem)
            self._server.soon(lambda: page.answer(request, fulfilled, text))
        threading.Thread(target=guarded(call), name='reset', daemon=True).start()

    def _confirmation(self, page, request, hearers, written, done):
        """Returns a function that answers `page`: as soon as the stop was written to each present
        connection, or after `CONFIRM_WITHIN`. A cut network may still lose a written stop.

        `hearers`: names of the nodes; `written()`: {connection: messages written to it}; `done`:
        the answer if the stop is confirmed.
        """
        before, begun, names = written(), steady_time(), ', '.join(sorted(hearers))

        def confirm():
            now = written()
            if not names:
                page.answer(request, False, 'no node hears it')
            elif all(now.get(link, 0) > count for link, count in before.items()):
                page.answer(request, True, done.format(names))
            elif steady_time() - begun > CONFIRM_WITHIN:
                page.answer(request, False, 'a connection to {} takes nothing'.format(names))
            else:
                self._server.later(CONFIRM_PERIOD, confirm)
        return confirm

    #: The method for each type of request.
    _ACTIONS = {'begin': _begin, 'joy': _joy, 'let go': _let_go, 'give': _give, 'take': _take,
                'stop': _stop, 'turn': _turn, 'goal': _goal, 'reset': _reset}

    # -- messages that were heard

    def _tell_holder(self, tell):
        """Soon call `tell(holder, now)`; any thread may call this."""
        def call():
            now = steady_time()
            tell(self.holder, now)
            self.flush(now)
        self._server.soon(call)

    def _is_driving(self):
        return self.watch.read(lambda view: view.is_driving)

    def _other_pad(self, now):
        """The name of another node that publishes `joy` now; '' if there is none."""
        age, name = self.watch.read(lambda view: (view.age('joy', now), view.latest('joy')))
        return name if age is not None and age < OTHER_PAD else ''

    def _pad_words(self, heard, now):
        """The state of the page's pad; '' if none is gripped."""
        if self.holder.pad is None:
            return ''
        if not heard.get('pad'):
            return 'no node'
        if self._other_pad(now):
            return 'other pad'
        holder = self.watch.read(lambda view: view.latest('holder'))
        if holder is None:    # no node publishes control_holder
            return 'ready' if self.holder.pad_heard_for(now) > PAD_IS_HEARD else 'connecting'
        return {'gamepad': 'ready', 'move_to_goal': 'held back'}.get(holder, 'connecting')
