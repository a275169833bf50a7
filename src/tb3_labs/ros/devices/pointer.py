"""The real mouse of this computer, by pynput (which needs an X display)."""
import os
import threading
from typing import Tuple

from tb3_labs.geometry.angles import clamp


class Pointer:
    """The position of the mouse, and calls when its wheel turns or it moves.

    If it cannot be read, the constructor raises ``ValueError`` with one sentence, and so does
    :meth:`position` when the display is lost.
    """

    def __init__(self, on_scroll, on_move):
        """`on_scroll(up)` and `on_move()` are called in a thread of pynput's."""
        if os.environ.get('WAYLAND_DISPLAY'):
            raise ValueError('the mouse cannot be read in a Wayland session: log in again with '
                             'an "Xorg" (X11) session')
        if not os.environ.get('DISPLAY'):
            raise ValueError('no display: the mouse can only be read on a computer with a screen '
                             '(DISPLAY is not set)')
        mouse = _pynput_mouse()
        self._hand = mouse.Controller()
        self._root = _root_window()
        # Never to be stopped or joined: on X11 that hangs. It is a daemon thread.
        self._listener = mouse.Listener(
            on_move=lambda x, y: on_move(),
            on_scroll=lambda x, y, dx, dy: dy and on_scroll(dy > 0))
        _end_quietly(self._listener)
        self._listener.start()
        self._listener.wait()

    def position(self):
        """(x, y), each from -1 to 1 over the whole screen, x to the right, y up."""
        try:
            if not self._listener.is_alive():
                raise EOFError('the listener has ended')
            screen = self._root.get_geometry()
            return screen_position(*self._hand.position, screen.width, screen.height)
        except Exception as problem:    # Xlib raises classes of its own, not all of them public
            raise ValueError('lost the display of the mouse ({})'.format(problem)) from None


def screen_position(pixel_x: float, pixel_y: float, width: float,
                    height: float) -> Tuple[float, float]:
    """A pixel (counted from the top left corner) as a position on a screen of that size."""
    return (clamp(2.0 * pixel_x / max(width - 1, 1) - 1.0, -1.0, 1.0),
            clamp(1.0 - 2.0 * pixel_y / max(height - 1, 1), -1.0, 1.0))


def _pynput_mouse():
    try:
        from pynput import mouse
    except ImportError as problem:
        if (problem.name or '').startswith('pynput'):
            raise ValueError('the mouse needs the Python package pynput: sudo apt install '
                             'python3-pynput (Ubuntu 20.04: sudo apt install python3-xlib; '
                             'pip3 install --no-deps pynput)') from None
        raise ValueError('cannot open the display {} to read the mouse'.format(
            os.environ['DISPLAY'])) from None
    return mouse


def _end_quietly(thread):
    """Print no traceback when `thread` dies with its display: :meth:`Pointer.position` reports it.
    """
    report = threading.excepthook
    threading.excepthook = lambda died: died.thread is thread or report(died)


def _root_window():
    from Xlib.display import Display
    return Display().screen().root
