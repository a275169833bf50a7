"""Questions to a master or a node by XML-RPC. All of them only read.

The calls are those of ROS's Master API and Slave API (wiki.ros.org).
"""
import email.utils
import http.client
import os
import socket
import time
import urllib.parse
import xmlrpc.client

from tb3_labs.doctor.network import Answer
from tb3_labs.ros.doctor.addresses import resolved
from tb3_labs.ros.doctor.deadline import within

#: The name under which the doctor asks; it is registered nowhere.
CALLER = '/doctor_{}'.format(os.getpid())
#: Longest wait for the address of a name, and for a connection or an answer [s].
RESOLVING = 1.0
ANSWERING = 1.0


class Refused(Exception):
    """A program answered that it cannot answer."""


class _Transport(xmlrpc.client.Transport):
    """With a limit for each wait; it keeps the date of the answer."""

    date = None

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = ANSWERING
        return connection

    def parse_response(self, response):
        if hasattr(response, 'getheader'):
            self.date = response.getheader('Date')
        return super().parse_response(response)


class Peer:
    """A master or a node, by its URI. `answer` tells how the last question went."""

    def __init__(self, uri):
        self.uri = uri
        self.host, self.address, self.port = '', '', 0
        #: Its clock minus ours by the date of its last answer [s, exact to a second]; or None.
        self.date_offset = None
        self.answer = Answer(uri, 'silent')

    def ask(self, method, *arguments):
        """What it answers; None if it does not, and `answer` tells why."""
        begun = time.monotonic()
        try:
            value, problem = self._ask(method, arguments), ''
        except Exception as trouble:    # a peer may answer with anything
            value, problem = None, _problem(trouble)
        self.answer = Answer(self.uri, problem, self.address, time.monotonic() - begun)
        return value

    def _ask(self, method, arguments):
        self._find()
        transport = _Transport()
        proxy = xmlrpc.client.ServerProxy('http://{}:{}/'.format(self.address, self.port),
                                          transport)
        code, reason, value = within(ANSWERING, getattr(proxy, method), CALLER, *arguments)
        if transport.date:
            # Its clock is cut down to whole seconds: half of one is missing on average.
            told = email.utils.parsedate_to_datetime(transport.date).timestamp()
            self.date_offset = told + 0.5 - time.time()
        if code != 1:
            raise Refused(reason)
        return value

    def _find(self):
        if self.address:
            return
        try:
            parts = urllib.parse.urlparse(self.uri)
            self.host, self.port = parts.hostname or '', parts.port or 0
        except ValueError:
            self.host = ''
        if not self.host or not self.port or parts.scheme != 'http':
            raise ValueError('malformed')
        try:
            self.address = within(RESOLVING, resolved, self.host)
        except (OSError, UnicodeError):
            raise socket.gaierror('unresolved') from None


def _problem(trouble):
    """The key of doctor.network.PROBLEMS for an exception."""
    for kind, problem in ((socket.gaierror, 'unresolved'), (ConnectionRefusedError, 'refused'),
                          (TimeoutError, 'silent'), (socket.timeout, 'silent'),
                          (ConnectionError, 'strange'), (http.client.HTTPException, 'strange'),
                          (OSError, 'unreachable')):
        if isinstance(trouble, kind):
            return problem
    return 'malformed' if str(trouble) == 'malformed' else 'strange'
