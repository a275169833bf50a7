"""The messages of one page: its requests, read into the types below, and what is sent to it.

A request is a JSON object:

    {"type": "look", "robot": "robot3"}      show this robot; null: the list of all
    {"type": "seen", "n": 20}                picture 20 was drawn
    {"type": "begin"}                        a person grips a control of this page
    {"type": "joy", "pad": {...}, "mouse": [x, y]}     state of each now; null: not gripped
    {"type": "let go"}                       the person is done
    {"type": "give"}, {"type": "take"}       give control to move_to_goal, take it
    {"type": "stop"}                         everything to zero
    {"type": "turn", "degrees": 90}          left positive
    {"type": "goal", "x": 1, "y": 0, "yaw_deg": 0}     drive there, in local [m, deg]
    {"type": "reset", "x": 0, "y": 0, "yaw_deg": 0}    the robot is here, now, in local

"pad" is {"forward": -1..1, "left": -1..1, "a": bool, "b": bool, "y": bool, "hold": bool}; "mouse"
counts from the middle of its square to its edges, -1..1, x right, y up. Each may have an "id", a
whole number: the answer has it too. "t" is the time at which it was sent [ms, the page's clock].
"pressed" is the time at which a person asked for it; in a "joy", the time at which A was pressed
[s, the panel's clock]. The page adds "now" of the last picture and the time since that picture.

Any other message raises ``ValueError`` with the reason: the invalid value, and the valid ones.

A page reports the number of each tenth picture that it has drawn. It is too slow if it has not
drawn the last `MOST_UNSEEN` of those that were sent to it: a laptop was suspended, or a network
holds everything up. Then its connection is closed, and nothing is stored for it. A page that
runs again connects anew, and sees the present picture, not the pictures of the past minutes.
"""
import json
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

from tb3_labs.geometry.se2 import MAX_DISTANCE, MAX_YAW_DEG, TypedPose
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.nodes.pad_config import PadConfig

#: A message with more characters is refused; the longest valid one has about 200.
LONGEST = 2000
#: The latest time of a clock [ms since 1970].
LATEST = 1e15
#: A turn is at most this [deg].
MOST_DEGREES = 360.0
#: Numbers of axes and buttons of the most common pad: students' nodes may read any of them.
AXES, BUTTONS = 8, 11
#: A page is dropped if it is behind by this number of pictures: 3 s at the usual rate.
MOST_UNSEEN = 60


class Pad(NamedTuple):
    """The pad of a page: sticks from -1 to 1, forward and left positive; buttons pressed."""

    forward: float = 0.0
    left: float = 0.0
    a: bool = False
    b: bool = False
    y: bool = False
    hold: bool = False

    def as_joy(self, config: PadConfig) -> Tuple[List[float], List[int]]:
        """Returns (axes, buttons) of a sensor_msgs/Joy, numbered as the node `gamepad` reads them.
        Axes are from -1 to 1, forward and left positive. A page need not know any numbers."""
        axes = [0.0] * max(AXES, 1 + config.linear_axis, 1 + config.angular_axis)
        axes[config.linear_axis] = self.forward
        axes[config.angular_axis] = self.left
        functions = {config.relinquish_button: self.a, config.regain_button: self.b,
                     config.reset_button: self.y}
        if config.has_hold:
            functions[config.hold_button] = self.hold
        buttons = [0] * max(BUTTONS, 1 + max(functions))
        for number, pressed in functions.items():
            buttons[number] = int(pressed)
        return axes, buttons


class Joy(NamedTuple):
    """The pad and the mouse pad that a person grips on a page; None if not gripped."""

    pad: Optional[Pad] = None
    mouse: Optional[Tuple[float, float]] = None


class Request(NamedTuple):
    """One message of a page."""

    kind: str
    value: Any = None              # see the readers below
    id: Optional[int] = None
    sent_at: Optional[float] = None    # [s, the page's clock]; None: unknown
    pressed: Optional[float] = None    # [s, the panel's clock]; None: unknown
    lateness: float = 0.0          # its delay beyond the usual one [s]


class Viewer:
    """One page; `send(text)` sends a message to it, `close()` drops it."""

    def __init__(self, send: Callable[[str], None], close: Callable[[], None]) -> None:
        self.close = close
        #: The robot that it looks at; None for the list of robots.
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
        """Answer `request` in words; `request` is None if it could not be read."""
        if request is not None and request.id is not None:
            self.send('answer', id=request.id, ok=fulfilled, text=text)
        elif not fulfilled:
            self.send('note', text=text, warning=True)

    def timed(self, request: Request, now: float) -> Request:
        """Returns `request` with its delay and the time of its press, on the clock of `now` [s].

        Without a time of the press, the press counts as made when the request was sent.
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


def read_request(text: Union[str, bytes]) -> Request:
    """Returns the Request in a message. ``ValueError``, with the reason, if it is invalid."""
    if len(text) > LONGEST:
        raise ValueError('a message of {} characters is refused: at most {} are valid'.format(
            len(text), LONGEST))
    try:
        # NaN and Infinity are not JSON, but Python's reader accepts them
        message = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as problem:
        raise ValueError('a message is not JSON: {}'.format(problem)) from None
    if not isinstance(message, dict):
        raise ValueError('a message must be an object with "type"')
    kind = message.get('type')
    reader = READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise ValueError('type {} is unknown; known: {}'.format(_short(kind), ', '.join(READERS)))
    given, sent, pressed = (message.get(name) for name in ('id', 't', 'pressed'))
    return Request(str(kind), reader(message),
                   None if given is None else _whole(message, 'id'),
                   None if sent is None else _number(message, 't', LATEST) / 1000.0,
                   None if pressed is None else _number(message, 'pressed', LATEST))


def _look(message: Dict) -> Optional[str]:
    robot = message.get('robot')
    if robot is not None and not isinstance(robot, str):
        raise _invalid('robot', robot, 'a name, or null')
    return robot


def _pose(message: Dict) -> TypedPose:
    # the node refuses invalid poses too, but the page would not show its reason
    return TypedPose(
        _number(message, 'x', MAX_DISTANCE, 'm'), _number(message, 'y', MAX_DISTANCE, 'm'),
        _number(message, 'yaw_deg', MAX_YAW_DEG, 'deg'))


def _joy(message: Dict) -> Joy:
    pad, mouse = message.get('pad'), message.get('mouse')
    if pad is not None and not isinstance(pad, dict):
        raise _invalid('pad', pad, 'an object, or null')
    if mouse is not None and not (isinstance(mouse, list) and len(mouse) == 2):
        raise _invalid('mouse', mouse, '[x, y], or null')
    return Joy(
        None if pad is None else Pad(
            _number(pad, 'forward', 1.0), _number(pad, 'left', 1.0),
            *[_flag(pad, button) for button in ('a', 'b', 'y', 'hold')]),
        None if mouse is None else (_number({'mouse': mouse[0]}, 'mouse', 1.0),
                                    _number({'mouse': mouse[1]}, 'mouse', 1.0)))


#: By type: the reader of a message's value.
READERS: Dict[str, Callable[[Dict], Any]] = {
    'look': _look, 'joy': _joy, 'goal': _pose, 'reset': _pose,
    'seen': lambda message: _whole(message, 'n'),
    'turn': lambda message: _number(message, 'degrees', MOST_DEGREES, 'deg'),
    **dict.fromkeys(('begin', 'let go', 'give', 'take', 'stop'), lambda message: None)}


def _number(message: Dict, name: str, most: float, unit: str = '') -> float:
    """Returns the number called `name`: finite, from -`most` to `most`."""
    value = message.get(name)
    # the comparison is False for NaN, infinity, and integers that are too large for a float
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= most:
        valid = 'a number from {:g} to {:g} {}'.format(-most, most, unit)
        raise _invalid(name, value, valid.rstrip())
    return float(value)


def _whole(message: Dict, name: str) -> int:
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 10 ** 12:
        raise _invalid(name, value, 'a whole number from 0')
    return value


def _flag(message: Dict, name: str) -> bool:
    value = message.get(name, False)
    if not isinstance(value, bool):
        raise _invalid(name, value, 'true or false')
    return value


def _invalid(name: str, value: Any, valid: str) -> ValueError:
    return ValueError('{} = {} is not valid: {}'.format(name, _short(value), valid))


def _short(value: Any) -> str:
    """`value` as a page writes it, cut if it is long."""
    try:
        text = json.dumps(value)
    except RecursionError:    # json reads a little deeper than it writes
        return 'a value that is nested too deeply'
    return text if len(text) <= 40 else text[:37] + '...'


def _no_number(name: str) -> None:
    raise ValueError('{} is not a number'.format(name))
