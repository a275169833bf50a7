"""The messages of one page: requests of the page, read into the types below, and answers to it.

A request is a JSON object:

    {"type": "joy", "pad": {...}, "mouse": [x, y], "first": bool}    what is held now, or null;
                                             "first": somebody has just gripped it
    {"type": "stop"}                         B, or STOP: everything to zero, no control
    {"type": "turn", "degrees": 90}          left positive
    {"type": "goal", "x": 1, "y": 0, "yaw_deg": 0}     drive there, in local [m, deg]
    {"type": "reset", "x": 0, "y": 0, "yaw_deg": 0}    the robot is here, now, in local

"pad" is {"forward": -1..1, "left": -1..1, "a": bool, "y": bool, "hold": bool}; "mouse" is 0 in
the middle of its square and -1 or 1 at its edges, x right, y up. Each request may have an "id", a
whole number, which the answer repeats. "stops" is the number of stops in the picture that the page
had when its person acted; see :mod:`tb3_labs.supervision.dead_man`. "t" is the time of sending on
the panel's clock [s]: "now" of the last picture plus the time since that picture. So a message can
seem older than it is, but not newer, apart from the steps of a browser's clock.

Any other message raises ``ValueError`` with the invalid value and the valid values.
"""
import json
from contextlib import suppress
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

from tb3_labs.geometry.se2 import MAX_DISTANCE, MAX_YAW_DEG, TypedPose
from tb3_labs.nodes.gamepad.pad import PadConfig

#: A message with more characters is refused; the longest valid one has about 250. JSON of this
#: length is not nested too deeply for Python.
LONGEST_REQUEST = 500
#: The latest time of a clock [s], and by how much a browser's clock may be ahead.
LATEST, MOST_AHEAD = 1e12, 0.2
#: A turn is at most this [deg].
MOST_DEGREES = 360.0
#: Number of axes and of buttons of the most common pad: students' nodes may read any of them.
PAD_AXES, PAD_BUTTONS = 8, 11


class BrowserPad(NamedTuple):
    """The pad of a page: sticks from -1 to 1, forward and left positive; is each button pressed? A
    page does not send b: it sends a "stop" for B."""

    forward: float = 0.0
    left: float = 0.0
    a: bool = False
    y: bool = False
    hold: bool = False
    b: bool = False

    def as_joy(self, config: PadConfig) -> Tuple[List[float], List[int]]:
        """Returns (axes, buttons) of a sensor_msgs/Joy, at the numbers that the node `gamepad`
        reads. Axes are from -1 to 1, forward and left positive."""
        axes = [0.0] * max(PAD_AXES, 1 + config.linear_axis, 1 + config.angular_axis)
        axes[config.linear_axis] = self.forward
        axes[config.angular_axis] = self.left
        functions = {config.relinquish_button: self.a, config.regain_button: self.b,
                     config.reset_button: self.y}
        if config.has_hold:
            functions[config.hold_button] = self.hold
        buttons = [0] * max(PAD_BUTTONS, 1 + max(functions))
        for number, pressed in functions.items():
            buttons[number] = int(pressed)
        return axes, buttons


class Grip(NamedTuple):
    """The pad and the mouse pad of a page; None if the person does not grip it."""

    pad: Optional[BrowserPad] = None
    mouse: Optional[Tuple[float, float]] = None
    is_first: bool = False         # is it the first message of this grip?


class PageRequest(NamedTuple):
    """One message of a page."""

    kind: str
    value: Any = None              # see the readers below
    id: Optional[int] = None
    stops: Optional[int] = None    # number of stops that the page knew; None: unknown
    sent_at: float = 0.0           # [s, the panel's clock]; 0: unknown, so the message is old

    def lateness(self, now: float) -> float:
        """Its delay [s]. Raises ``ValueError`` if it was not sent yet."""
        if self.sent_at > now + MOST_AHEAD:
            raise ValueError(f't = {self.sent_at} is not valid: at most {now:.1f}, which is now')
        return max(0.0, now - self.sent_at)


class Viewer:
    """One page; `send(text)` sends a message to the page."""

    def __init__(self, send: Callable[[str], None]) -> None:
        #: Lines of the log that were not sent to the page yet.
        self.lines: List[Dict[str, str]] = []
        self._send = send

    def send(self, kind: str, **values: Any) -> None:
        """Send a message of this type."""
        self._send(json.dumps(dict(values, type=kind), allow_nan=False))

    def answer(self, request: Optional[PageRequest], fulfilled: bool, text: str) -> None:
        """Answer `request` by a text; `request` is None if it could not be read."""
        if request is not None and request.id is not None:
            self.send('answer', id=request.id, ok=fulfilled, text=text)
        elif not fulfilled:
            # the grip on the page is ignored: the person must let go
            self.send('refused', text=text)


def read_request(text: Union[str, bytes]) -> PageRequest:
    """Returns the PageRequest in a message. Raises ``ValueError``, with the reason, if it is
    invalid."""
    if len(text) > LONGEST_REQUEST:
        raise ValueError(f'a message of {len(text)} characters is refused: at most '
                         f'{LONGEST_REQUEST} are valid')
    try:
        message = json.loads(text)
        read = READERS[message['type']]
    except (ValueError, TypeError, KeyError):
        raise ValueError(f'{text!r:.60} is not valid: an object with a known "type"') from None
    if message['type'] == 'stop':      # a stop is obeyed, also if its other entries are invalid
        with suppress(ValueError):
            return _request(message, read)
        return PageRequest('stop')
    return _request(message, read)


def _request(message: Dict, read: Callable[[Dict], Any]) -> PageRequest:
    sent_at = 0.0 if message.get('t') is None else _number(message, 't', LATEST)
    return PageRequest(message['type'], read(message), _checked(message, 'id', int, None),
                       _checked(message, 'stops', int, None), sent_at)


def _pose(message: Dict) -> TypedPose:
    # the node refuses invalid poses too, but the page would not show its reason
    return TypedPose(
        _number(message, 'x', MAX_DISTANCE, 'm'), _number(message, 'y', MAX_DISTANCE, 'm'),
        _number(message, 'yaw_deg', MAX_YAW_DEG, 'deg'))


def _grip(message: Dict) -> Grip:
    pad, mouse = _checked(message, 'pad', dict, None), _checked(message, 'mouse', list, None)
    if pad is not None:
        pad = BrowserPad(_number(pad, 'forward', 1.0), _number(pad, 'left', 1.0),
                         *[_checked(pad, button, bool, False) for button in ('a', 'y', 'hold')])
    if mouse is not None:
        if len(mouse) != 2:
            raise ValueError('mouse is not valid: [x, y], or null')
        mouse = tuple(_number({'mouse': value}, 'mouse', 1.0) for value in mouse)
    return Grip(pad, mouse, _checked(message, 'first', bool, False))


#: {type: the reader of a message's value}
READERS: Dict[str, Callable[[Dict], Any]] = {
    'joy': _grip, 'goal': _pose, 'reset': _pose, 'stop': lambda message: None,
    'turn': lambda message: _number(message, 'degrees', MOST_DEGREES, 'deg')}


def _number(message: Dict, name: str, most: float, unit: str = '') -> float:
    """Returns the number called `name`: finite, from -`most` to `most`."""
    value = message.get(name)
    # the comparison is False for NaN, infinity, and integers that are too large for a float
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= most:
        raise ValueError(f'{name} = {json.dumps(value):.40} is not valid: a number from {-most:g} '
                         f'to {most:g} {unit}'.rstrip())
    return float(value)


def _checked(message: Dict, name: str, kind: type, missing: Any) -> Any:
    """Returns the value called `name`, or `missing`; ``ValueError`` if its type is not `kind`."""
    value = message.get(name, missing)
    if value is not missing and type(value) is not kind:    # to Python a bool is an int
        raise ValueError(f'{name} is not valid: {kind.__name__}')
    return value
