"""The start of a submission's node: the intake prepares it, and the trial carries it out."""
import json
import os
from pathlib import Path
from typing import Any, Dict, NamedTuple, Optional, Sequence

#: This package, of which a submission's program sees only a part.
OWN_PACKAGE = 'tb3_labs'
#: The environment variable of the identity. Each try of a submission has its own value.
IDENTITY = 'TB3_LABS_SUBMISSION'
#: The environment variable with the path of the file that holds a NodeStart.
NODE_START_FILE = 'TB3_LABS_NODE_START'
#: The folders in a sandbox that are the program's own.
HOME = '/home/student'
OWN_FOLDERS = '/tmp', HOME, '/dev/shm'
#: The command that limits a program without a sandbox: the largest file [bytes].
LARGEST_FILE = 50 * 10 ** 6
FILES_LIMITED = ['prlimit', f'--fsize={LARGEST_FILE}']
#: The command that starts a node. It dies with the process that tries it out. If the processor is
#: busy, the robot comes before the node.
NODE_PREFIX = ['setpriv', '--pdeathsig', 'KILL', 'nice', '-n', '5']


class NodeStart(NamedTuple):
    """The start of a node: `prefix`, then its own command. mark.py writes it into a file. The
    check, another process, reads it and starts the node."""

    prefix: Sequence[str] = NODE_PREFIX + FILES_LIMITED
    environment: Optional[Dict[str, str]] = None        # None: the environment of this process
    types: Optional[Dict[str, Any]] = None      # of the student; see message_examples.py
    isolated: bool = False      # is the node in a Sandbox?
    program: str = ''           # the path of the program; '': rosrun finds it
    package: str = ''           # the name of its package
    copy: str = ''              # the folder of the submission
    text: str = ''              # the path of the node's file in `copy`

    @classmethod
    def from_environment(cls) -> 'NodeStart':
        """Returns the NodeStart that mark.py wrote; a check without mark.py has no sandbox."""
        if NODE_START_FILE not in os.environ:
            return cls()
        return cls(*json.loads(Path(os.environ[NODE_START_FILE]).read_text()))

    def write(self, path: Path) -> Dict[str, str]:
        """Write the NodeStart into a file. Returns the variable by which a process finds it."""
        path.write_text(json.dumps(self))
        return {NODE_START_FILE: str(path)}
