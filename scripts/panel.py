#!/usr/bin/env python3
"""Shows one robot, or a class of robots, on a page in any browser, and lets it be driven there.

It prints the page's address. It only listens to a robot while a page looks at it. A page is one
more sender on the topics of the labs: the rules of control are those of the nodes that listen.

Subscribes, while a page looks
    imu, odom, cmd_vel, joy, local_pose, local_path, goal_state, current_goal, has_control,
    control_holder, distance_error, angle_error_deg, ground_truth, /tf, /tf_static, /rosout,
    move_to_goal/parameter_updates, ctrl_relinq, move2goal/cancel
Publishes, when a person asks for it on a page
    joy                     sensor_msgs/Joy: the page's pad, with the numbers that gamepad uses
    mouse_info              tb3_labs/MouseController: the page's mouse
    turn                    std_msgs/Float64 [deg]
    move_base_simple/goal   geometry_msgs/PoseStamped, frame local
    ctrl_relinq             std_msgs/Bool: True is renewed while the page that gave it is there
    cmd_vel                 geometry_msgs/Twist: one zero for each stop
Calls
    reset_pose              tb3_labs/ResetPose
Parameters
    ~port, ~address, ~control, ~robots, ...: see PanelConfig in tb3_labs.panel.panel_config
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.early_ctrl_c    # noqa: F401 (first: it is for the other imports)

import json
import sys
import threading

import rospy

from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.panel.panel_config import PanelConfig
from tb3_labs.panel.requests import read_request
from tb3_labs.panel.viewer import Viewer
from tb3_labs.panel.wheel import LONGEST_DELAY
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.console import log_news, say
from tb3_labs.ros.reset_call import call_reset
from tb3_labs.ros.node import guarded, run
from tb3_labs.ros.panel.log_lines import LogLines, lines_of
from tb3_labs.ros.panel.robot import PanelRobot
from tb3_labs.ros.panel.watch import Watch
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.signals import when_stopped

try:
    from tb3_labs.ros.panel.server import Server, Timer, Worker
except ModuleNotFoundError as missing:
    sys.exit('panel: {}: sudo apt install python3-tornado'.format(missing))

#: Time between two looks at pages that drive [s],
WHEEL_PERIOD = 0.02
#: and between two lists of all robots [s].
LIST_PERIOD = 0.5
#: After this time without a page a robot is no longer listened to [s]: a page may be loaded again.
PATIENCE = 3.0
#: When the node ends: longest wait until the pages' controls are released [s].
RELEASE_TIME = 0.5
#: Requests that count however late they come.
STOPS = ('stop', 'take', 'let go', 'hand')
#: Time within which a stop must be written to be confirmed, and between two looks [s].
CONFIRM_WITHIN, CONFIRM_PERIOD = 0.5, 0.005
#: Stands for an answer that another thread gives.
LATER = object()


class Page:
    """One page: its connection, its pace, the robot that it looks at."""

    def __init__(self, send, close):
        self.send = lambda message: send(json.dumps(message, allow_nan=False))
        self.close = close
        self.viewer = Viewer()
        self.lateness = Lateness()
        self.robot = None            # None: the list
        self.log_count = None        # lines of the log that were sent to it; None: none yet
        self.past_count = None       # beginnings of the trails that were sent to it; None: none yet


class Panel:
    """Connects pages and robots. Its methods run in the thread of the server."""

    def __init__(self):
        config, self._model = read_config(PanelConfig), read_model()
        self._control = config.control
        self._pages = []
        self._log = LogLines()
        self._server = Server(config, self._open_page)
        self._worker = Worker()
        self._robots = {name: PanelRobot(name, config.control, self._server.soon, self._worker)
                        for name in config.names}
        self._drawing = Timer(1.0 / config.rate, self._draw)
        self._listing = Timer(LIST_PERIOD, self._list)
        self._wheels = Timer(WHEEL_PERIOD, self._update_wheels)
        rospy.on_shutdown(self._release)
        when_stopped(self._release, lambda: None)
        self._server.start()
        # not logged: whoever knows the address, with its token, may drive
        say('Panel: open {} in a browser{}'.format(
            self._server.address, '' if self._control else ' (it only shows)'))

    # -- pages come and go

    def _open_page(self, send, close):
        page = Page(send, close)
        self._pages.append(page)
        page.send({'type': 'hello', 'control': self._control, 'radius': self._model.body_radius,
                   'robots': [{'name': name} for name in self._robots]})
        if len(self._robots) == 1:
            self._look(page, *self._robots)
        self._drawing.start()
        self._listing.start()
        return (lambda text: self._on_text(page, text)), (lambda: self._on_end(page))

    def _on_end(self, page):
        """The page has gone, or is dropped; the second of both changes nothing."""
        if page not in self._pages:
            return
        self._pages.remove(page)
        self._leave_robot(page)
        if not self._pages:
            self._drawing.stop()
            self._listing.stop()
        self._server.later(PATIENCE, self._look_at_robots)

    def _look(self, page, name):
        """Show the robot `name`; None: the list."""
        if name is not None and name not in self._robots:
            raise ValueError('robot {!r} is unknown; known: {}'.format(
                name, ', '.join(self._robots)))
        self._leave_robot(page)
        page.robot = None if name is None else self._robots[name]
        self._look_at_robots()
        page.log_count = None
        page.past_count = None
        self._send_log(page)

    def _leave_robot(self, page):
        if page.robot is not None:
            page.robot.wheel.gone(page)
            self._flush(page.robot)
            page.robot = None

    def _look_at_robots(self):
        """Listen to what the pages look at, and to nothing else."""
        listed = Watch.SUMMARY if any(page.robot is None for page in self._pages) else Watch.NOTHING
        for robot in self._robots.values():
            seen = any(page.robot is robot for page in self._pages)
            robot.look(Watch.ALL if seen else listed)

    # -- what pages see

    def _draw(self):
        pictures = {}
        for page in list(self._pages):
            if page.log_count != self._log.count:
                self._send_log(page)
            if page.robot is not None:
                self._send_trails(page)
                self._send_picture(page, pictures)

    @staticmethod
    def _send_trails(page):
        """Send the trails so far, at first and when they get a new beginning."""
        if page.past_count != page.robot.past_count:
            page.past_count = page.robot.past_count
            page.send(dict(page.robot.trails(), type='trail', robot=page.robot.name))

    def _send_log(self, page):
        """Send the new lines of the log that concern the page's robot; at first all lines."""
        is_first, count = page.log_count is None, self._log.count
        lines = lines_of(self._log.since(page.log_count or 0), self._robots,
                         page.robot.name if page.robot else None)
        page.log_count = count
        if lines or is_first:
            page.send({'type': 'log', 'all': is_first, 'lines': lines})

    def _send_picture(self, page, pictures):
        """Send the picture of the page's robot; `pictures` holds those that were made just now."""
        if page.viewer.is_too_slow:
            rospy.loginfo('A page is too slow, and dropped: it connects anew when it can')
            self._on_end(page)
            page.close()
            return
        robot, now = page.robot, steady_time()
        if robot not in pictures:
            pictures[robot] = robot.picture(now)
        driver = robot.wheel.page
        page.send(dict(
            pictures[robot], type='picture', n=page.viewer.next_picture(), robot=robot.name,
            now=now, wheel='' if driver is None else 'you' if driver is page else 'other'))

    def _list(self):
        pages = [page for page in self._pages if page.robot is None]
        if pages:
            now = steady_time()
            message = {'type': 'robots',
                       'robots': [robot.summary(now) for robot in self._robots.values()]}
            for page in pages:
                page.send(message)

    # -- what pages ask for

    def _on_text(self, page, text):
        request = None
        try:
            request = read_request(text)
            answer = self._carry_out(page, request)
        except ValueError as problem:
            self._answer(page, request, False, str(problem))
        else:
            if answer is not LATER:
                self._answer(page, request, True, answer or '')

    @staticmethod
    def _answer(page, request, fulfilled, text):
        if request is not None and request.id is not None:
            page.send({'type': 'answer', 'id': request.id, 'ok': fulfilled, 'text': text})
        elif not fulfilled:
            page.send({'type': 'note', 'text': text, 'warning': True})

    def _carry_out(self, page, request):
        """The answer to a request, in words; None: there is nothing to say; or LATER."""
        now = steady_time()
        lateness = 0.0 if request.sent_at is None else page.lateness.of(request.sent_at, now)
        pressed = now - lateness
        if request.pressed is not None:
            pressed = min(pressed, request.pressed)
        if request.kind == 'look':
            return self._look(page, request.value)
        if request.kind == 'seen':
            return page.viewer.has_seen(request.value)
        if not self._control:
            raise ValueError('this panel only shows: it was started with control:=false')
        if page.robot is None:
            raise ValueError('choose a robot first')
        if now - pressed > LONGEST_DELAY and request.kind not in STOPS:
            raise ValueError('this came {:.1f} s late, and does not count: ask again'.format(
                now - pressed))
        answer = self._drive(page, page.robot, request, now, lateness, pressed)
        self._flush(page.robot)
        return answer

    def _drive(self, page, robot, request, now, lateness, pressed):
        if request.kind == 'hand':
            return robot.hand(page, request.value, now, lateness, pressed)
        if request.kind == 'begin':
            return robot.begin(page, now, pressed)
        if request.kind == 'let go':
            return robot.wheel.let_go(page)
        if request.kind == 'give':
            return robot.give(page, now, pressed)
        if request.kind == 'take':
            return self._confirm(page, request, robot.take(page, now, pressed), now)
        if request.kind == 'stop':
            return self._confirm(page, request, robot.stop(page, now, pressed), now)
        if request.kind == 'turn':
            return robot.turn(page, request.value, pressed)
        if request.kind == 'goal':
            return robot.goal(page, request.value, pressed)
        return self._reset(page, robot, request)

    def _confirm(self, page, request, stop, said_at):
        """Answer when the stop is confirmed, or that it is not."""
        if stop.is_confirmed or steady_time() - said_at > CONFIRM_WITHIN:
            self._answer(page, request, *stop.in_words())
        else:
            self._server.later(CONFIRM_PERIOD, lambda: self._confirm(page, request, stop, said_at))
        return LATER

    def _reset(self, page, robot, request):
        """Call the service in a thread of its own: it may take a second."""
        place = request.value

        def call():
            try:
                fulfilled, text = True, call_reset(place.x, place.y, place.yaw_deg, prefix=robot.prefix)
            except ValueError as problem:
                fulfilled, text = False, str(problem)
            self._server.soon(lambda: self._answer(page, request, fulfilled, text))
        threading.Thread(target=guarded(call), name='reset', daemon=True).start()
        return LATER

    # -- the wheels

    def _flush(self, robot):
        """Publish what the robot's wheel says, tell its news, and watch it while a page has it."""
        robot.flush(steady_time())
        news = robot.wheel.take_news()
        log_news(news)
        for line in news:
            for page in self._pages:
                if page.robot is robot:
                    page.send({'type': 'note', 'text': line.text, 'warning': line.warning})
        if robot.wheel.page is not None:
            self._wheels.start()

    def _update_wheels(self):
        driven = [robot for robot in self._robots.values() if robot.wheel.page is not None]
        for robot in driven:
            robot.wheel.update(steady_time())
            self._flush(robot)
        if not driven:
            self._wheels.stop()

    def _release(self):
        """The node ends, or stands still: release all that pages hold."""
        released = threading.Event()

        def release():
            for page in list(self._pages):
                self._leave_robot(page)
            released.set()
        self._server.soon(release)
        released.wait(RELEASE_TIME)


if __name__ == '__main__':
    run('panel', Panel)
