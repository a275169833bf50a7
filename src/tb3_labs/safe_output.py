"""Prints without errors, even to a closed terminal, a full disk or a broken pipe."""
import contextlib
import sys
from typing import Any, Callable, List


class SafeStream:
    """A stream that drops a text that cannot be written. An exception could end a node before it
    has stopped the robot, or end a marking program before it has written the marks."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream    # None if Python started without this stream

    def write(self, text: str) -> None:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            self._stream.write(text)
            self._stream.flush()

    def flush(self) -> None:    # :meth:`write` flushes each text
        pass

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def run_tool(main: Callable[[List[str]], int]) -> None:
    """Call `main` with the words of the command line, and exit with the status that it returns. A
    character that the terminal cannot show is printed as its code."""
    for name in ('stdout', 'stderr'):
        with contextlib.suppress(AttributeError):    # the stream is None
            getattr(sys, name).reconfigure(errors='backslashreplace')
        setattr(sys, name, SafeStream(getattr(sys, name)))
    sys.exit(main(sys.argv[1:]))
