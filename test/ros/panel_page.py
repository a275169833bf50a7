"""A page of the panel without a browser. It sends the messages of a person's pad and mouse."""
import asyncio
import json
import re
import threading
import time

from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from tb3_labs.ros.clocks import steady_time

#: Time between two messages while the person holds pad or mouse [s].
PERIOD = 0.1
AT_REST = {'forward': 0, 'left': 0, 'a': False, 'y': False, 'hold': True}


def address_of(panel):
    """Waits until `panel`, a TestProgram, has printed its address. Returns the address."""
    panel.wait_for('in a browser')
    return re.search(r'open (http\S+) in', panel.text).group(1)


class PanelPage:
    """Connects to the panel at `address` ('http://localhost:8080/?token=...').

    It keeps the latest message of each type, all answers, and counts the pictures.
    """

    def __init__(self, address, headers=None):
        self.latest = {}
        self.answers = {}
        self.notes = []
        self.pictures = 0
        self.closed = threading.Event()
        self._changed = threading.Condition()
        self._held = None                # the message that is repeated, or None
        self._number = 0
        place, mark, query = address.partition('?')
        self._request = HTTPRequest(f"{place.replace('http', 'ws', 1)}socket{mark}{query}", headers=headers)
        self._loop = asyncio.new_event_loop()
        self._socket = None
        self.refusal = None
        opened = threading.Event()
        threading.Thread(target=self._run, args=(opened,), daemon=True).start()
        opened.wait(10.0)
        if self.refusal is not None:
            raise ConnectionRefusedError(self.refusal)
        self.wait_until(lambda: 'picture' in self.latest, 10.0, 'a picture')

    # -- acts of a person

    def send(self, kind, **values):
        """Send a message with the time, and with the number of stops that this page knows."""
        message = dict({'t': steady_time(), 'stops': self.picture['stops']}, **values, type=kind)
        self.send_text(json.dumps(message))

    def send_text(self, text):
        self._loop.call_soon_threadsafe(self._write, text)

    def ask(self, kind, seconds=5.0, **values):
        """Send a request. Returns (fulfilled?, text) of the answer."""
        self._number += 1
        number = self._number
        self.send(kind, id=number, **values)
        self.wait_until(lambda: number in self.answers, seconds, 'the answer to ' + kind)
        return self.answers[number]['ok'], self.answers[number]['text']

    def hold(self, pad=None, mouse=None):
        """From now on send ten times a second that the person holds `pad` and `mouse`. `pad` has the entries that
        differ from AT_REST. Until :meth:`let_go` the person ignores stops."""
        is_first = self._held is None
        stops = self.picture['stops'] if is_first else self._held['stops']
        self._held = {'pad': None if pad is None else dict(AT_REST, **pad), 'mouse': mouse,
                      'stops': stops}
        self.send('joy', first=is_first, **self._held)

    def let_go(self):
        self._held = None
        self.send('joy', pad=None, mouse=None)

    def fall_silent(self):
        self._held = None

    def freeze(self, seconds):
        """Read and send nothing for `seconds`, as on a suspended laptop."""
        self._loop.call_soon_threadsafe(time.sleep, seconds)

    def close(self):
        self._held = None

        def close():
            if self._socket is not None:
                self._socket.close()
        self._loop.call_soon_threadsafe(close)
        self.closed.wait(5.0)

    # -- messages of the panel

    @property
    def picture(self):
        return self.latest['picture']

    def wait_until(self, condition, seconds=20.0, what='a condition'):
        """Wait until `condition()` holds. Raises RuntimeError after `seconds`."""
        with self._changed:
            if not self._changed.wait_for(condition, seconds):
                raise RuntimeError('waited {:.0f} s in vain for {}; refused: {}, last picture: {}'.format(
                    seconds, what, sorted(set(self.notes)), self.latest.get('picture')))

    def wait_for(self, seconds=20.0, **values):
        """Wait for a picture with these values."""
        self.wait_until(lambda: all(self.latest.get('picture', {}).get(name) == value
                                    for name, value in values.items()), seconds, str(values))

    # -- the thread of the websocket

    def _run(self, opened):
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._connect(opened))
        finally:
            self.closed.set()
            opened.set()

    async def _connect(self, opened):
        try:
            self._socket = await websocket_connect(self._request)
        except Exception as error:    # any exception; the test reads its text
            self.refusal = str(error)
            return
        opened.set()
        repetition = asyncio.ensure_future(self._repeat())
        while True:
            text = await self._socket.read_message()
            if text is None:
                break
            self._on_message(json.loads(text))
        repetition.cancel()

    async def _repeat(self):
        while True:
            await asyncio.sleep(PERIOD)
            held = self._held
            if held is not None:
                self.send('joy', **held)

    def _write(self, text):
        if self._socket is not None and not self.closed.is_set():
            self._socket.write_message(text)

    def _on_message(self, message):
        with self._changed:
            self.latest[message['type']] = message
            if message['type'] == 'answer':
                self.answers[message['id']] = message
            elif message['type'] == 'refused':
                self.notes.append(message['text'])
            elif message['type'] == 'picture':
                self.pictures += 1
            self._changed.notify_all()
