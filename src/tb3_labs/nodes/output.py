"""What leaves a core: one Output for each message, and for each look at the clock."""
from dataclasses import dataclass
from typing import Optional, Sequence

from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.events import News


@dataclass(frozen=True)
class Output:
    """What a core wants done now. A node may add fields of its own."""

    #: The command to send; zero stops the robot. None: no command is due.
    command: Optional[Twist2] = None
    #: One zero goes before the command, since another driver begins.
    stops_first: bool = False
    #: Lines for the user.
    news: Sequence[News] = ()
    #: May the robot move, so that the clock must be looked at often?
    watched: bool = False

    @property
    def has_more(self) -> bool:
        """Is there anything to be carried out after the command?"""
        return bool(self.news)
