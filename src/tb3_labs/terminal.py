"""A terminal that may be gone at any time, a full disk, a pipe without a reader."""
import contextlib
from typing import Any, Optional, TextIO


class SafeStream:
    """A stream whose text is lost once its terminal is closed, its disk full, or its reader gone.
    Otherwise a line would end a node before its last zero, or cost a student's marks."""

    def __init__(self, stream: Optional[TextIO]) -> None:
        """`stream`: None if it was never open."""
        self._stream = stream

    def write(self, text: str) -> None:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            self._stream.write(text)    # type: ignore[union-attr]
            self._stream.flush()        # type: ignore[union-attr]

    def flush(self) -> None:
        """Do nothing: each text was flushed when it was written."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
