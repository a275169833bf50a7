"""A roslaunch command, as it was typed."""
from typing import Dict, List, NamedTuple, Optional

from tb3_labs.ros.launching.roslaunch_internals import only_lists, read_options

#: Separates an argument's name from its value.
GIVES = ':='


class Command(NamedTuple):
    """What roslaunch was asked for."""

    file: str                   # the path of the launch file
    words: List[str]            # the arguments, as they were typed
    port: Optional[str]         # of the master, if it is not that of ROS_MASTER_URI

    @property
    def arguments(self) -> Dict[str, str]:
        """{name: value}, without ROS's own, which begin with two underscores."""
        given = (word.partition(GIVES) for word in self.words)
        return {name: value for name, _, value in given if not name.startswith('__')}


def read(words: List[str]) -> Optional[Command]:
    """The Command of words that follow `roslaunch`; None where there is nothing to check: it only
    lists, or has not exactly one launch file, as roslaunch says by itself."""
    found = read_options(words)
    if found is None or only_lists(found.options) or len(found.files) != 1:
        return None
    return Command(found.files[0], [word for word in words if GIVES in word], found.options.port)
