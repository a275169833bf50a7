"""How a student's node is started: what stands before its command, and its environment.

mark.py writes it into a file, since another process, the check, starts the node.
"""
import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional

from tb3_labs.marking.sandbox import NoSandbox

#: The variable with the path of that file.
VARIABLE = 'TB3_LABS_LAUNCH'
#: The node dies with the process that tries it out, and leaves the processor to the robot if both
#: want it.
ALWAYS = ['setpriv', '--pdeathsig', 'KILL', 'nice', '-n', '10']
#: The master of its world is told by the world.
MASTER = 'ROS_MASTER_URI'


@dataclass
class Launch:
    """The start of a node: `prefix`, then its own command."""

    prefix: List[str] = field(default_factory=lambda: ALWAYS + NoSandbox.command([]))
    environment: Optional[Dict[str, str]] = None            # None: that of this process
    types: Optional[Dict[str, Any]] = None                  # of the student; see messages_in_sandbox
    boxed: bool = False

    def write(self, path):
        """Write it into a file."""
        Path(path).write_text(json.dumps(asdict(self)))

    @classmethod
    def given(cls):
        """As mark.py wrote it; without mark.py there is no box."""
        if VARIABLE not in os.environ:
            return cls()
        return cls(**json.loads(Path(os.environ[VARIABLE]).read_text()))

    def in_this_world(self):
        """The environment of the node, with this process's master; None as above."""
        if self.environment is None:
            return None
        return dict(self.environment, **{MASTER: os.environ[MASTER]})
