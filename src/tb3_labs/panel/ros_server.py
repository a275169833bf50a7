"""Sends the page's files to browsers, and opens a websocket for each page. Source: tornado 6."""
import asyncio
import errno
import os
import re
import secrets
import socket
import threading
from contextlib import suppress
from pathlib import Path

import rosgraph.network
import rospy
from tornado import httpserver, netutil, web, websocket

from tb3_labs import drawing
from tb3_labs.panel.access import LOOPBACK, Access
from tb3_labs.panel.requests import MAX_REQUEST_LENGTH
from tb3_labs.ros.node import guarded

#: Requests for files with these suffixes need no token, because such files show no robot.
PUBLIC_SUFFIXES = ('.css', '.js', '.svg')
PAGE_FILES = Path(__file__).resolve().parent / 'page'
DRAWING_FILE_PATTERN = '|'.join(re.escape(path.name) for path in drawing.FOLDER.iterdir()
                                if path.suffix in PUBLIC_SUFFIXES)
PING_PERIOD = 1.0           # [s]
#: If a page does not answer a ping within this time [s], the server disconnects the page. The
#: page's computer may be suspended, or the network may stall. The page tries to connect again.
PONG_TIMEOUT = 3.0
#: The server closes a connection that sends no complete request within this time [s].
REQUEST_TIMEOUT = 10.0
MAX_TRIED_PORTS = 10
#: The page loads only files of this server, and no other site can show the page in a frame.
HEADERS = {
    'Content-Security-Policy': "default-src 'self'; connect-src 'self' ws: wss:; "
                               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    'X-Content-Type-Options': 'nosniff', 'X-Frame-Options': 'DENY',
    'Referrer-Policy': 'no-referrer',    # the address may contain the token
    'Cache-Control': 'no-cache'}


class Server:
    """Offers the page at the address of a PanelConfig, in a separate thread.

    The server calls `open_page(send)` for each page that connects. `send(text)` sends a message to
    the page. `open_page` returns two functions. The server calls the first, `on_text(text)`, with
    each message of the page, and the second, `on_end()`, when the page is closed. An unusable
    address raises ``ValueError``.
    """

    def __init__(self, config, open_page):
        if config.address == LOOPBACK:
            names, token, shown_name = [], '', 'localhost'
        else:
            names = _names_of_this_computer(config.address)
            token = secrets.token_urlsafe(12)
            shown_name = config.address
        if config.address == '0.0.0.0':
            shown_name = rosgraph.network.get_local_address()
        self._access = Access(names, token)
        self._open_page = open_page
        self._sockets, port = _bind(config.port, config.address)
        self.address = f'http://{shown_name}:{port}/'
        if token:
            self.address += '?token=' + token
        self._loop = asyncio.new_event_loop()

    def start(self):
        threading.Thread(target=guarded(self._run), name='server', daemon=True).start()

    def call_soon(self, job):
        """Run `job()` soon in the thread `server`. Any thread may call this method."""
        with suppress(RuntimeError):    # the server has ended
            self._loop.call_soon_threadsafe(guarded(job))

    def call_later(self, seconds, job):
        """Run `job()` after `seconds`. Only the thread `server` may call this method."""
        self._loop.call_later(seconds, guarded(job))

    def _run(self):
        asyncio.set_event_loop(self._loop)
        application = web.Application([
            (r'/socket', _Socket, {'access': self._access, 'open_page': self._open_page}),
            (f'/({DRAWING_FILE_PATTERN})', _File,
             {'access': self._access, 'path': str(drawing.FOLDER)}),
            (r'/(.*)', _File, {'access': self._access, 'path': str(PAGE_FILES),
                               'default_filename': 'index.html'})],
            log_function=lambda handler: None, websocket_max_message_size=4 * MAX_REQUEST_LENGTH,
            websocket_ping_interval=PING_PERIOD, websocket_ping_timeout=PONG_TIMEOUT)
        # Tornado reads a request's body before Access checks the request. Therefore the body may
        # have at most 1 byte. The limit is not 0, because tornado 5 takes 0 for no limit.
        server = httpserver.HTTPServer(application, max_body_size=1, body_timeout=REQUEST_TIMEOUT,
                                       idle_connection_timeout=REQUEST_TIMEOUT)
        server.add_sockets(self._sockets)
        self._loop.run_forever()


def run_in_thread(job):
    """Run `job()`, which may wait, in a separate thread. The thread `server` must not wait, because
    the thread `server` receives the stops."""
    threading.Thread(target=guarded(job), name='job', daemon=True).start()


class _CheckedHandler:
    """If Access refuses a request, answers with the reason in one line."""

    def initialize(self, access, **options):
        self._access = access
        super().initialize(**options)

    def set_default_headers(self):
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self):
        headers = self.request.headers
        is_public = self.request.path.endswith(PUBLIC_SUFFIXES)
        token = None if is_public else self.get_query_argument('token', '')
        reason = self._access.refusal_reason(headers.get('Host'), headers.get('Origin'), token)
        if reason:
            rospy.logwarn_throttle(1.0, 'a browser was refused: ' + reason)
            self.set_status(403)
            self.finish(f'tb3_labs: {reason}\n')


class _File(_CheckedHandler, web.StaticFileHandler):
    """Serves the files in the folder `path`."""


class _Socket(_CheckedHandler, websocket.WebSocketHandler):
    def initialize(self, access, open_page):
        super().initialize(access)
        self._open_page = open_page
        self._on_text, self._on_end = None, None    # set by open()

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
        # if the page is closed during write_message(), tornado calls on_close()
        with suppress(websocket.WebSocketClosedError):
            # asyncio would log an exception that nobody reads
            self.write_message(text).add_done_callback(lambda sent: sent.exception())


def _bind(port, address):
    """Returns (sockets, port) of a free port. Raises ``ValueError`` if no port can be used."""
    for tried_port in range(port, port + MAX_TRIED_PORTS):
        try:
            sockets = netutil.bind_sockets(tried_port, address)
        except OSError as error:
            last_problem = error
            if error.errno != errno.EADDRINUSE:    # another port would not help
                break
        else:
            if tried_port != port:
                rospy.logwarn('port %d is in use: the panel takes %d', port, tried_port)
            return sockets, tried_port
    raise ValueError(f'the panel cannot be offered at {address}, port {port}: {last_problem}')


def _names_of_this_computer(address):
    """Returns the names and addresses by which other computers may reach this computer."""
    names = {address, socket.gethostname(), socket.getfqdn(),
             os.environ.get('ROS_IP', ''), os.environ.get('ROS_HOSTNAME', '')}
    return sorted((names | set(rosgraph.network.get_local_addresses())) - {'', '0.0.0.0'})
