"""Reads the messages of one page and answers the page. An invalid message raises ``ValueError``
with the invalid value and the valid values.

A request is a JSON object:

    {"type": "joy", "pad": {...}, "mouse": [x, y], "first": bool}    a person drives by pad or mouse
    {"type": "stop"}                         STOP, or B: the robot stops, move_to_goal loses control
    {"type": "turn", "degrees": 90}          left positive
    {"type": "goal", "x": 1, "y": 0, "yaw_deg": 0}     a goal in local [m, deg]
    {"type": "reset", "x": 0, "y": 0, "yaw_deg": 0}    the robot's current pose in local [m, deg]

The entry "pad" is {"forward": -1..1, "left": -1..1, "a": bool, "y": bool, "hold": bool}, or null if
the person does not hold the pad. The entry "mouse" is the place in the square, or null if the
person does not hold the mouse. In the square, x is from -1 (left edge) to 1 (right edge), and y is
from -1 (lower edge) to 1 (upper edge). The entry "first" is true in the first message after the
person took hold of pad or mouse.

Each request may have an "id", a whole number, which the answer repeats. The entry "stops" repeats
the "stops" of the picture that the person saw. If the robot was stopped after this picture,
:mod:`tb3_labs.supervision.dead_man` rejects the request, unless the request is a stop.

The entry "t" is the time [s] at which the page sent the request, on the panel's clock. The page
computes "t" as the "now" of the latest picture plus the time since this picture arrived. Because
the picture also needed time to arrive, "t" is too early. Therefore the panel overestimates the
delay of a request. It underestimates the delay only if the browser's clock jumps.
"""
import json
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

from tb3_labs.handout import PAD_AXES, PAD_BUTTONS
from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.supervision.events import Queue
from tb3_labs.supervision.goal_requests import MAX_COORDINATE, MAX_YAW_DEG, TypedPose

#: The panel refuses a message of more characters. The longest valid message has about 250
#: characters. A message of 500 characters cannot be nested so deeply that Python's parser fails.
MAX_REQUEST_LENGTH = 500
MAX_SENT_TIME = 1e12        # [s], the largest valid "t"
#: A browser's clock may be ahead of the panel's clock by at most this time [s].
MAX_CLOCK_AHEAD = 0.2
MAX_TURN_DEG = 360.0


class BrowserPad(NamedTuple):
    """The gamepad that a page shows. The sticks are from -1 to 1, forward and left positive. `b` is
    False in each message of a page, because the page sends a "stop" when a person presses B."""

    forward: float = 0.0
    left: float = 0.0
    a: bool = False
    y: bool = False
    hold: bool = False
    b: bool = False

    def as_joy(self, config: PadConfig) -> Tuple[List[float], List[int]]:
        """Returns (axes, buttons) of a sensor_msgs/Joy, numbered as in `config`."""
        axes = [0.0] * max(PAD_AXES, 1 + config.linear_axis, 1 + config.angular_axis)
        axes[config.linear_axis] = self.forward
        axes[config.angular_axis] = self.left
        pressed = {config.relinquish_button: self.a, config.regain_button: self.b,
                   config.reset_button: self.y}
        if config.has_hold:
            pressed[config.hold_button] = self.hold
        buttons = [0] * max(PAD_BUTTONS, 1 + max(pressed))
        for index, is_pressed in pressed.items():
            buttons[index] = int(is_pressed)
        return axes, buttons


class HeldInputs(NamedTuple):
    """The pad and the mouse that a person holds on a page."""

    pad: Optional[BrowserPad] = None               # None if the person does not hold the pad
    mouse: Optional[Tuple[float, float]] = None    # None if the person does not hold the mouse
    is_first: bool = False    # the message is the first since the person took hold


class PageRequest(NamedTuple):
    """One message of a page."""

    type: str
    value: Union[HeldInputs, TypedPose, float, None] = None    # see READERS
    id: Optional[int] = None
    known_stops: Optional[int] = None    # the entry "stops", or None if it is missing
    sent_at: float = 0.0                 # the entry "t", or 0 if it is missing

    def lateness(self, now: float) -> float:
        """Returns the delay [s]. Raises ``ValueError`` if `sent_at` is later than `now`."""
        if self.sent_at > now + MAX_CLOCK_AHEAD:
            raise ValueError(f't = {self.sent_at} is not valid: at most {now:.1f}, which is now')
        return max(0.0, now - self.sent_at)


class OpenPage:
    """One open page. `send(text)` sends a message to the page."""

    def __init__(self, send: Callable[[str], None]) -> None:
        self.unsent_lines: Queue[Dict[str, str]] = Queue()    # lines of the log
        self._send = send

    def send(self, message_type: str, **values: Any) -> None:
        self._send(json.dumps(dict(values, type=message_type), allow_nan=False))

    def answer(self, request: Optional[PageRequest], is_fulfilled: bool, text: str) -> None:
        """Send the answer to `request`. `request` is None if the request could not be read."""
        if request is not None and request.id is not None:
            self.send('answer', id=request.id, ok=is_fulfilled, text=text)
        elif not is_fulfilled:
            # the page then releases pad and mouse, and the person must take hold of them again
            self.send('refused', text=text)


def read_request(text: Union[str, bytes]) -> PageRequest:
    """Returns the PageRequest in a message. Raises ``ValueError`` if the message is invalid."""
    if len(text) > MAX_REQUEST_LENGTH:
        raise ValueError(f'a message of {len(text)} characters is refused: at most '
                         f'{MAX_REQUEST_LENGTH} are valid')
    try:
        message = json.loads(text)
        read = READERS[message['type']]
    except (ValueError, TypeError, KeyError):
        raise ValueError(f'{text!r:.60} is not valid: an object with a known "type"') from None
    try:
        return _read_fields(message, read)
    except ValueError:
        if message['type'] == 'stop':    # a stop with an invalid "id" is still a stop
            return PageRequest('stop')
        raise


def _read_fields(message: Dict, read: Callable[[Dict], Any]) -> PageRequest:
    has_time = message.get('t') is not None
    return PageRequest(
        type=message['type'], value=read(message), id=_read_optional(message, 'id', int),
        known_stops=_read_optional(message, 'stops', int),
        sent_at=_read_number(message, 't', MAX_SENT_TIME) if has_time else 0.0)


def _read_pose(message: Dict) -> TypedPose:
    # move_to_goal would also refuse an invalid pose, but the page would not show its reason
    return TypedPose(
        _read_number(message, 'x', MAX_COORDINATE, 'm'),
        _read_number(message, 'y', MAX_COORDINATE, 'm'),
        _read_number(message, 'yaw_deg', MAX_YAW_DEG, 'deg'))


def _read_held_inputs(message: Dict) -> HeldInputs:
    pad = _read_optional(message, 'pad', dict)
    mouse = _read_optional(message, 'mouse', list)
    return HeldInputs(pad=None if pad is None else _read_pad(pad),
                      mouse=None if mouse is None else _read_mouse(mouse),
                      is_first=_read_optional(message, 'first', bool, missing=False))


def _read_pad(pad: Dict) -> BrowserPad:
    buttons = {name: _read_optional(pad, name, bool, missing=False) for name in ('a', 'y', 'hold')}
    return BrowserPad(forward=_read_number(pad, 'forward', 1.0),
                      left=_read_number(pad, 'left', 1.0), **buttons)


def _read_mouse(mouse: List) -> Tuple[float, float]:
    if len(mouse) != 2:
        raise ValueError('mouse is not valid: [x, y], or null')
    x, y = mouse
    return _valid_number(x, 'mouse', 1.0), _valid_number(y, 'mouse', 1.0)


READERS: Dict[str, Callable[[Dict], Any]] = {
    'joy': _read_held_inputs, 'goal': _read_pose, 'reset': _read_pose, 'stop': lambda message: None,
    'turn': lambda message: _read_number(message, 'degrees', MAX_TURN_DEG, 'deg')}


def _read_number(message: Dict, name: str, limit: float, unit: str = '') -> float:
    return _valid_number(message.get(name), name, limit, unit)


def _valid_number(value: Any, name: str, limit: float, unit: str = '') -> float:
    """Returns `value`. Raises ``ValueError`` if it is not a number from -`limit` to `limit`."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    is_valid = is_number and -limit <= value <= limit
    if not is_valid:
        raise ValueError(f'{name} = {json.dumps(value):.40} is not valid: a number from {-limit:g} '
                         f'to {limit:g} {unit}'.rstrip())
    return float(value)


def _read_optional(message: Dict, name: str, value_type: type, missing: Any = None) -> Any:
    """Returns the value called `name`, or `missing` if the message does not have it. Raises
    ``ValueError`` if the type of the value is not `value_type`."""
    value = message.get(name, missing)
    if value is not missing and type(value) is not value_type:    # for isinstance, True is an int
        raise ValueError(f'{name} is not valid: {value_type.__name__}')
    return value
