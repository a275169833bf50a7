"""What a node's core has to tell its user; the node prints it."""
from typing import NamedTuple


class News(NamedTuple):
    """One line; `warning` where it is not what was asked for."""

    text: str
    warning: bool = False


class NewsDesk:
    """Collects News until somebody takes them."""

    def __init__(self):
        self._waiting = []

    def tell(self, text, warning=False):
        """Add a line."""
        self._waiting.append(News(text, warning))

    def take(self):
        """All News since the last call."""
        news, self._waiting = self._waiting, []
        return news
