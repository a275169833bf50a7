"""Connects the pages with the robots: pages come and go, get pictures, and send requests."""
import threading
import time
from collections import deque

from rosgraph_msgs.msg import Log

from tb3_labs.panel.requests import Viewer, read_request
from tb3_labs.panel.ros_robot import PanelRobot
from tb3_labs.panel.ros_server import Server, Timer, Worker
from tb3_labs.panel.ros_watch import Watch
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.node import log_news
from tb3_labs.ros.topics import subscribe

#: Pages that hold a robot are checked once in this time [s].
HOLDER_PERIOD = 0.02
#: The list of all robots is sent once in this time [s].
LIST_PERIOD = 0.5
#: A robot is listened to for this long after its last page closed [s]: the page may be reloaded.
PATIENCE = 3.0
#: When the node ends: longest wait until the pages' controls are released [s].
RELEASE_TIME = 0.5
#: Number of log lines kept for a page that comes later.
LINES_KEPT = 200
#: A log line is cut after this number of characters.
LONGEST_LINE = 500
LEVELS = ((Log.ERROR, 'error'), (Log.WARN, 'warn'), (Log.INFO, 'info'))


class Pages:
    """Connects pages and robots. Its methods run in the thread of the server."""

    def __init__(self, config, body_radius):
        """Offer the page as a PanelConfig says; `body_radius`: of the robots [m]."""
        self._hello = {'control': config.control, 'radius': body_radius,
                       'robots': [{'name': name} for name in config.names]}
        self._pages = []
        self._lines = deque(maxlen=LINES_KEPT)
        self._server = Server(config, self._open_page)
        worker = Worker()
        self._robots = {name: PanelRobot(name, config.control, self._server, worker)
                        for name in config.names}
        self._drawing = Timer(1.0 / config.rate, self._draw)
        self._listing = Timer(LIST_PERIOD, self._list)
        self._holders = Timer(HOLDER_PERIOD, self._update_holders)
        subscribe('/rosout', Log, self._on_line, queue_size=None)
        #: The address to open in a browser.
        self.address = self._server.address
        self._server.start()

    def release(self):
        """Release all that pages hold, as the node ends or stands still; any thread may call it."""
        released = threading.Event()

        def release():
            for page in list(self._pages):
                self._leave_robot(page)
            released.set()
        self._server.soon(release)
        released.wait(RELEASE_TIME)

    # -- pages come and go

    def _open_page(self, send):
        page = Viewer(send)
        self._pages.append(page)
        page.send('hello', **self._hello)
        if len(self._robots) == 1:
            self._look(page, *self._robots)
        self._drawing.start()
        self._listing.start()
        return (lambda text: self._on_text(page, text)), (lambda: self._on_end(page))

    def _on_end(self, page):
        """The page has closed."""
        self._pages.remove(page)
        self._leave_robot(page)
        if not self._pages:
            self._drawing.stop()
            self._listing.stop()
        self._server.later(PATIENCE, self._look_at_robots)

    def _look(self, page, name):
        """Show the robot `name` on `page`; None: the list of robots."""
        if name is not None and name not in self._robots:
            raise ValueError('robot {!r} is unknown; known: {}'.format(
                name, ', '.join(self._robots)))
        self._leave_robot(page)
        page.robot = None if name is None else self._robots[name]
        self._look_at_robots()
        if page.robot is not None:
            odom, local = page.robot.watch.read(lambda view: (
                list(view.trail_in_odom.points), list(view.trail_in_local.points)))
            page.send('trail', odom=odom, local=local, robot=name)
        page.lines = list(self._lines)
        self._send_log(page, is_all=True)

    def _leave_robot(self, page):
        if page.robot is not None:
            page.robot.holder.gone(page)
            self._flush(page.robot)
            page.robot = None

    def _look_at_robots(self):
        """Listen to the robots that pages look at, and to nothing else."""
        listed = Watch.SUMMARY if any(page.robot is None for page in self._pages) else Watch.NOTHING
        for robot in self._robots.values():
            seen = any(page.robot is robot for page in self._pages)
            robot.look(Watch.ALL if seen else listed)

    # -- pictures and lines of the log

    def _draw(self):
        pictures = {}    # robot: its picture, made once
        for page in self._pages:
            if page.lines:
                self._send_log(page)
            if page.robot is not None:
                self._send_picture(page, pictures)

    def _on_line(self, message):
        """Keep a line of /rosout. The lines of each node come in a thread of their own."""
        level = next((name for least, name in LEVELS if message.level >= least), None)
        if level is not None:
            line = {'time': time.strftime('%H:%M:%S'), 'level': level, 'node': message.name,
                    'text': message.msg[:LONGEST_LINE]}
            self._server.soon(lambda: self._keep(line))

    def _keep(self, line):
        self._lines.append(line)
        for page in self._pages:
            page.lines.append(line)

    def _send_log(self, page, is_all=False):
        """Send the page's waiting lines, without those of nodes of other robots."""
        others = tuple('/{}/'.format(robot.name) for robot in self._robots.values()
                       if robot.name and robot is not page.robot)
        lines = [line for line in page.lines if not (line['node'] + '/').startswith(others)]
        page.lines = []
        if lines or is_all:
            page.send('log', all=is_all, lines=lines)

    def _send_picture(self, page, pictures):
        robot, now = page.robot, steady_time()
        if robot not in pictures:
            pictures[robot] = robot.picture(now)
        holder = robot.holder.page
        page.send('picture', **pictures[robot], robot=robot.name, now=now,
                  page='' if holder is None else 'this' if holder is page else 'other')

    def _list(self):
        pages = [page for page in self._pages if page.robot is None]
        if pages:
            now = steady_time()
            robots = [dict(robot.watch.read(lambda view: view.picture(now)), name=robot.name)
                      for robot in self._robots.values()]
            for page in pages:
                page.send('robots', robots=robots)

    # -- requests of pages

    def _on_text(self, page, text):
        request = None
        try:
            request = page.timed(read_request(text), steady_time())
            answer = self._carry_out(page, request)
        except ValueError as problem:
            page.answer(request, False, str(problem))
        else:
            if answer is not None:
                page.answer(request, True, answer)

    def _carry_out(self, page, request):
        """Do what a request asks for. Returns the answer in words; None if it comes later."""
        if request.kind == 'look':
            self._look(page, request.value)
            return ''
        if not self._hello['control']:
            raise ValueError('this panel only shows: it was started with control:=false')
        if page.robot is None:
            raise ValueError('choose a robot first')
        answer = page.robot.carry_out(page, request)
        self._flush(page.robot)
        return answer

    # -- the holders

    def _flush(self, robot):
        """Publish the holder's messages, show its news, and begin to check it for silence."""
        robot.flush(steady_time())
        news = robot.holder.take_news()
        log_news(news)
        for line in news:
            for page in self._pages:
                if page.robot is robot:
                    page.send('note', text=line.text, warning=line.warning)
        if robot.holder.page is not None:
            self._holders.start()

    def _update_holders(self):
        held = [robot for robot in self._robots.values() if robot.holder.page is not None]
        for robot in held:
            robot.holder.update(steady_time())
            self._flush(robot)
        if not held:
            self._holders.stop()
