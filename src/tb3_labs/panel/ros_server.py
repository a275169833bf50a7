"""The web server: the page's files, and a websocket for each page. Source: tornado 6."""
import asyncio
import errno
import os
import re
import secrets
import socket
import threading
from pathlib import Path
from weakref import WeakSet

import rosgraph.network
import rospy
from tornado import httpserver, netutil, web, websocket

from tb3_labs import drawing
from tb3_labs.panel.access import LOOPBACK, Access
from tb3_labs.panel.requests import LONGEST_REQUEST
from tb3_labs.ros.node import guarded

#: Files of these types need no token. The page itself and its socket need it.
PUBLIC = ('.css', '.js', '.svg')
#: The files of the page: HTML, style and program.
PAGE_FILES = Path(__file__).resolve().parent / 'page'
#: The names of the files that draw a robot, as a regular expression.
DRAWING_NAMES = '|'.join(re.escape(path.name) for path in drawing.FOLDER.iterdir()
                         if path.suffix in PUBLIC)
#: Each page is pinged once in this time [s].
PING_PERIOD = 1.0
#: A page that does not answer for this long is disconnected [s]: its computer was suspended, or the
#: network stalls. Later it connects again, and shows the present picture.
PONG_WITHIN = 3.0
#: A connection without a complete request for this long is closed [s].
REQUEST_WITHIN = 10.0
#: Most open connections, of one address and of all: this node may open about 1000 files.
MOST_OF_ADDRESS, MOST_CONNECTIONS = 32, 128
#: Ports that are tried if the first one is in use.
PORTS = 10
#: The page loads nothing from elsewhere, and no other site can show it in a frame.
HEADERS = {
    'Content-Security-Policy': "default-src 'self'; connect-src 'self' ws: wss:; "
                               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    'X-Content-Type-Options': 'nosniff', 'X-Frame-Options': 'DENY',
    'Referrer-Policy': 'no-referrer',    # the address may hold the token
    'Cache-Control': 'no-cache'}


class Server:
    """Offers the page at the address of a PanelConfig, in a separate thread.

    `open_page(send)` is called for each page that connects; `send(text)` sends a message to it. It
    returns two functions: the first is called with each message (a str) of the page, the second at
    the page's end. Raises ``ValueError`` if the address cannot be used.
    """

    def __init__(self, config, open_page):
        is_local = config.address == LOOPBACK
        token = '' if is_local else secrets.token_urlsafe(12)
        self._access = Access([] if is_local else _names_of_this_computer(config.address), token)
        self._open_page = open_page
        self._sockets, port = _bind(config.port, config.address)
        name = 'localhost' if is_local else _shown_name(config.address)
        #: The address to open in a browser.
        self.address = f"http://{name}:{port}/{'?token=' + token if token else ''}"
        self._admitted = WeakSet()
        self._loop = asyncio.new_event_loop()

    def start(self):
        """Offer the page from now on."""
        threading.Thread(target=guarded(self._run), name='server', daemon=True).start()

    def soon(self, job):
        """Run `job()` soon in the thread of the server; any thread may call this."""
        try:
            self._loop.call_soon_threadsafe(guarded(job))
        except RuntimeError:
            pass    # the server has ended

    def later(self, seconds, job):
        """Run `job()` after `seconds`; only the thread of the server may call this."""
        self._loop.call_later(seconds, guarded(job))

    def _run(self):
        asyncio.set_event_loop(self._loop)
        application = web.Application([
            (r'/socket', _Socket, {'access': self._access, 'open_page': self._open_page,
                                   'admit': self._admitted.add}),
            (f'/({DRAWING_NAMES})', _File, {'access': self._access, 'path': str(drawing.FOLDER)}),
            (r'/(.*)', _File, {'access': self._access, 'path': str(PAGE_FILES),
                               'default_filename': 'index.html'})],
            log_function=lambda handler: None, websocket_max_message_size=4 * LONGEST_REQUEST,
            websocket_ping_interval=PING_PERIOD, websocket_ping_timeout=PONG_WITHIN)
        # tornado reads a body before Access checks the request. The page never sends a body, but
        # tornado 5 reads 0 as no limit.
        server = _ConnectionLimit(application, max_body_size=1, body_timeout=REQUEST_WITHIN,
                                  idle_connection_timeout=REQUEST_WITHIN)
        server.admitted = self._admitted
        server.add_sockets(self._sockets)
        self._loop.run_forever()


class _ConnectionLimit(httpserver.HTTPServer):
    """Limits the number of open connections. Above a limit it closes the oldest connection that
    does not belong to a page: a browser sends its request at once. A page's connection stays open.
    If all other connections belong to pages, the new connection is closed."""

    #: The streams of pages that were admitted.
    admitted = frozenset()
    _open = ()    # (stream, address of its other end), oldest first

    def handle_stream(self, stream, address):
        self._open = [each for each in self._open if not each[0].closed()] + [(stream, address[0])]
        for most, group in (
                (MOST_OF_ADDRESS, [each for each, host in self._open if host == address[0]]),
                (MOST_CONNECTIONS, [each for each, _ in self._open if not each.closed()])):
            if len(group) > most:
                rospy.logwarn_throttle(10.0, 'more than {} connections ({}): one is closed'.format(
                    most, address[0]))
                next(each for each in group if each not in self.admitted).close()
        if not stream.closed():
            super().handle_stream(stream, address)


def in_thread(job):
    """Run `job()`, which may wait, in a separate thread: the server's thread must read stops."""
    threading.Thread(target=guarded(job), name='job', daemon=True).start()


class _CheckedHandler:
    """Answers each request that Access refuses with one line, the reason."""

    def initialize(self, access, **options):
        self._access = access
        super().initialize(**options)

    def set_default_headers(self):
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self):
        headers, is_public = self.request.headers, self.request.path.endswith(PUBLIC)
        token = None if is_public else self.get_query_argument('token', '')
        refusal = self._access.refusal(headers.get('Host'), headers.get('Origin'), token)
        if refusal:
            rospy.logwarn_throttle(1.0, 'a browser was refused: ' + refusal)
            self.set_status(403)
            self.finish(f'tb3_labs: {refusal}\n')


class _File(_CheckedHandler, web.StaticFileHandler):
    """Serves the files of the page, and no file outside of their folder."""


class _Socket(_CheckedHandler, websocket.WebSocketHandler):
    """The connection of one page."""

    def initialize(self, access, open_page, admit):
        super().initialize(access)
        self._open_page, self._admit = open_page, admit
        self._on_text = self._on_end = None

    def prepare(self):
        super().prepare()
        if not self._finished:
            self._admit(self.request.connection.stream)

    def open(self):
        self.set_nodelay(True)
        on_text, on_end = self._open_page(self._send)
        self._on_text, self._on_end = guarded(on_text), guarded(on_end)

    def on_message(self, message):
        self._on_text(message)

    def on_close(self):
        if self._on_end is not None:
            self._on_end()

    def _send(self, text):
        try:
            # the returned future fails if the page closes now; on_close() reports that
            self.write_message(text).add_done_callback(lambda sent: sent.exception())
        except websocket.WebSocketClosedError:
            pass


def _bind(port, address):
    """Returns (sockets, port), bound to the first free port; ``ValueError`` if that fails."""
    for number in range(port, port + PORTS):
        try:
            sockets = netutil.bind_sockets(number, address)
        except OSError as problem:
            last = problem
            if problem.errno != errno.EADDRINUSE:
                break
        else:
            if number != port:
                rospy.logwarn('port %d is in use: the panel takes %d', port, number)
            return sockets, number
    raise ValueError(f'the panel cannot be offered at {address}, port {port}: {last}')


def _names_of_this_computer(address):
    """Returns the names and addresses under which other computers may reach this one."""
    names = {address, socket.gethostname(), socket.getfqdn(),
             os.environ.get('ROS_IP', ''), os.environ.get('ROS_HOSTNAME', '')}
    return sorted((names | set(rosgraph.network.get_local_addresses())) - {'', '0.0.0.0', '::'})


def _shown_name(address):
    if address not in ('0.0.0.0', '::'):
        return f'[{address}]' if ':' in address else address
    return rosgraph.network.get_local_address()
