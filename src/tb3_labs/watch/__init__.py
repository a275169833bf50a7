"""What does a node do inside? Its variables, the quantities that they follow, its first mistake."""
import os
from pathlib import Path
from typing import Dict, Mapping

#: The folder of the probe, which has no other file.
PROBE = Path(__file__).with_name('probe')


def watched(environment: Mapping[str, str], probe: str = str(PROBE)) -> Dict[str, str]:
    """Returns the environment of a Python node that shows its variables by the probe."""
    folders = [probe, environment.get('PYTHONPATH', '')]
    return dict(environment, PYTHONPATH=os.pathsep.join(filter(None, folders)))
