"""Lines of a node's core for its user; the node prints them."""
from typing import List, NamedTuple


class News(NamedTuple):
    """One line; `warning`: something went otherwise than asked for."""

    text: str
    warning: bool


class NewsDesk:
    """Collects News until they are taken."""

    def __init__(self) -> None:
        self._waiting: List[News] = []

    def tell(self, text: str, warning: bool = False) -> None:
        """Add a line."""
        self._waiting.append(News(text, warning))

    def take(self) -> List[News]:
        """All News since the last call."""
        news, self._waiting = self._waiting, []
        return news
