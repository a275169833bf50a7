"""One page that looks at robots: its messages, and its pace.

A page reports the number of each tenth picture that it has drawn. A page is too
slow if it has not drawn the last `MOST_UNSEEN` of those that were sent to it: a suspended laptop,
or a network that holds everything up. Its connection is closed, and nothing is stored for it. It
connects anew when it runs again, and then sees the present picture, not those of the past minutes.
"""
import json
from typing import Any, Callable, Dict, List, Optional

from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.panel.requests import Request

#: A page is dropped when this number of pictures is under way: 3 s at the usual rate.
MOST_UNSEEN = 60


class Viewer:
    """One page; `send(text)` sends a message to it, `close()` drops it."""

    def __init__(self, send: Callable[[str], None], close: Callable[[], None]) -> None:
        self.close = close
        #: The robot that it looks at; None: the list.
        self.robot: Any = None
        #: Lines of the log that were not sent to it yet.
        self.lines: List[Dict[str, str]] = []
        #: Number of the last picture that was sent; the first one is 1.
        self.sent = 0
        self._seen = 0
        self._send = send
        self._lateness = Lateness()

    def send(self, kind: str, **values: Any) -> None:
        """Send a message of this type."""
        self._send(json.dumps(dict(values, type=kind), allow_nan=False))

    def answer(self, request: Optional[Request], fulfilled: bool, text: str) -> None:
        """Answer a request in words; None: it could not be read."""
        if request is not None and request.id is not None:
            self.send('answer', id=request.id, ok=fulfilled, text=text)
        elif not fulfilled:
            self.send('note', text=text, warning=True)

    def timed(self, request: Request, now: float) -> Request:
        """`request` with its delay, and the time of its press on the clock of `now` [s].

        A page that tells no press has sent the request at once.
        """
        late = 0.0 if request.sent_at is None else self._lateness.of(request.sent_at, now)
        pressed = now - late if request.pressed is None else min(now - late, request.pressed)
        return request._replace(lateness=late, pressed=pressed)

    def send_picture(self, picture: Dict[str, Any], **values: Any) -> None:
        """Send the next picture, with the `values` for this page."""
        self.sent += 1
        self.send('picture', n=self.sent, **picture, **values)

    def has_seen(self, number: int) -> None:
        """The page has drawn picture `number`; ``ValueError`` if it was not sent yet."""
        if number > self.sent:
            raise ValueError('picture {} was not sent yet: the last one is {}'.format(
                number, self.sent))
        self._seen = max(self._seen, number)

    @property
    def is_too_slow(self) -> bool:
        """Is the page to be dropped?"""
        return self.sent - self._seen >= MOST_UNSEEN
