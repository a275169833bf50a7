"""Sends pictures and lines of the log to the pages, and answers the requests of the pages."""
import threading
import time
from collections import deque
from functools import partial

import rospy
from rosgraph_msgs.msg import Log
from tornado.ioloop import PeriodicCallback

from tb3_labs.panel.requests import OpenPage, read_request
from tb3_labs.panel.ros_control import RobotControl
from tb3_labs.panel.ros_server import Server
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import subscribe

DEAD_MAN_PERIOD_MS = 20.0
#: When the node ends, it waits at most this time [s] until the robot has been stopped.
RELEASE_TIMEOUT = 0.5
#: A new page gets at most this many older log lines.
MAX_KEPT_LINES = 200
MAX_LINE_LENGTH = 500       # [characters]
#: {level of a message: name of the level on a page}
LEVEL_NAMES = {Log.FATAL: 'error', Log.ERROR: 'error', Log.WARN: 'warn', Log.INFO: 'info'}


class Pages:
    """The open pages and their robot. Unless said otherwise, methods run in the thread `server`."""

    def __init__(self, config, body_radius):
        """`config` is a PanelConfig. `body_radius` is the radius [m] of the robot's body."""
        self._greeting = {'control': config.control, 'radius': body_radius,
                          'robot': rospy.get_namespace().strip('/')}
        self._pages = []
        self._lines = deque(maxlen=MAX_KEPT_LINES)
        self._server = Server(config, self._open_page)
        self._robot = RobotControl(self._server)
        # the timers run while a page is open
        self._timers = [PeriodicCallback(guarded(self._send_pictures), 1000.0 / config.rate),
                        PeriodicCallback(guarded(self._robot.check_dead_man), DEAD_MAN_PERIOD_MS)]
        subscribe('/rosout', Log, self._on_line, queue_size=None)
        self.address = self._server.address
        self._server.start()

    def release(self):
        """Stop the robot if a page drives. Any thread may call this method when the node ends."""
        has_released = threading.Event()

        def stop_driving():
            if self._robot.dead_man.driving_page is not None:
                self._robot.stop()
            has_released.set()
        self._server.call_soon(stop_driving)
        has_released.wait(RELEASE_TIMEOUT)

    def _open_page(self, send):
        """Add a page, to which `send(text)` sends a message. Returns two functions: the server
        calls the first with each message of the page, and the second when the page is closed."""
        page = OpenPage(send)
        if not self._pages:
            self._robot.dead_man.start(steady_time())
            for timer in self._timers:
                timer.start()
        self._pages.append(page)
        page.send('hello', **self._greeting)
        page.unsent_lines.extend(self._lines)
        return partial(self._on_text, page), partial(self._on_end, page)

    def _on_end(self, page):
        self._pages.remove(page)
        self._robot.on_page_lost(page)
        if not self._pages:
            for timer in self._timers:
                timer.stop()

    # -- pictures and lines of the log

    def _send_pictures(self):
        now = steady_time()
        picture = self._robot.picture(now)
        for page in self._pages:
            lines = page.unsent_lines.pop_all()
            if lines:
                page.send('log', lines=lines)
            page.send('picture', **picture, now=now, page=self._driving_page_seen_by(page))

    def _driving_page_seen_by(self, page):
        """Returns 'this' if `page` drives the robot, 'other' if another page drives, or else ''."""
        driving_page = self._robot.dead_man.driving_page
        if driving_page is None:
            return ''
        return 'this' if driving_page is page else 'other'

    def _on_line(self, message):
        """Pass a message of /rosout to the pages. Several threads may call this method."""
        is_of_robot = message.name.startswith(rospy.get_namespace())
        if message.level not in LEVEL_NAMES or not is_of_robot:
            return
        self._robot.subscriptions.use_view(lambda view: view.on_log_line(message.msg))
        line = {'time': time.strftime('%H:%M:%S'), 'level': LEVEL_NAMES[message.level],
                'node': message.name, 'text': message.msg[:MAX_LINE_LENGTH]}
        self._server.call_soon(partial(self._add_line, line))

    def _add_line(self, line):
        self._lines.append(line)
        for page in self._pages:
            page.unsent_lines.append(line)

    # -- requests of pages

    def _on_text(self, page, text):
        request = None
        try:
            request = read_request(text)
            if not self._greeting['control']:
                raise ValueError('this panel only shows: it was started with control:=false')
            answer = self._robot.carry_out(page, request)
        except ValueError as error:
            page.answer(request, is_fulfilled=False, text=str(error))
        except Exception as error:    # the panel must go on, because it must stop robots
            rospy.logerr('a page asked for what cannot be done (%s): %s', error, text)
            self._robot.on_page_lost(page)
            page.answer(request, is_fulfilled=False, text=f'this cannot be done: {error}')
        else:
            if answer is not None:
                page.answer(request, is_fulfilled=True, text=answer)
