"""The start of a submission's node, as the intake prepares it and the trial carries it out."""
import json
import os
from pathlib import Path
from typing import Any, Dict, NamedTuple, Optional, Sequence

#: This package, of which a submission's program sees only a part.
OWN_PACKAGE = 'tb3_labs'
#: The environment variable of the identity; each try of a submission has its own value.
IDENTITY = 'TB3_LABS_SUBMISSION'
#: The folders that are a program's own in a sandbox.
HOME = '/home/student'
OWN_FOLDERS = '/tmp', HOME, '/dev/shm'
#: The command that limits a program without a sandbox: the largest file [bytes].
LARGEST_FILE = 50 * 10 ** 6
FILES_LIMITED = ['prlimit', f'--fsize={LARGEST_FILE}']
#: The environment variable with the path of a file that holds a Launch.
VARIABLE = 'TB3_LABS_LAUNCH'
#: The node dies with the process that tries it out. If the processor is busy, the robot comes
#: before the node.
ALWAYS = ['setpriv', '--pdeathsig', 'KILL', 'nice', '-n', '5']


class Launch(NamedTuple):
    """The start of a node: `prefix`, then its own command. mark.py writes it into a file; another
    process, the check, reads it and starts the node."""

    prefix: Sequence[str] = ALWAYS + FILES_LIMITED
    environment: Optional[Dict[str, str]] = None            # None: the environment of this process
    types: Optional[Dict[str, Any]] = None      # of the student; see message_examples.py
    isolated: bool = False
    program: str = ''           # the path of the node; '': rosrun finds it
    package: str = ''           # its name
    copy: str = ''              # the folder of the submission
    text: str = ''              # the path of the node's file in it

    @classmethod
    def from_environment(cls) -> 'Launch':
        """The Launch that mark.py wrote; without mark.py, one without a sandbox."""
        if VARIABLE not in os.environ:
            return cls()
        return cls(*json.loads(Path(os.environ[VARIABLE]).read_text()))

    def write(self, path: Path) -> Dict[str, str]:
        """Write the Launch into a file. Returns the variable by which a process finds it."""
        path.write_text(json.dumps(self))
        return {VARIABLE: str(path)}
