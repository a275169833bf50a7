"""What is the first mistake inside a node? The variables of the node show it."""
import os
from pathlib import Path
from typing import Dict, Mapping

#: The folder of the probe, which contains no other file.
PROBE = Path(__file__).with_name('probe')


def with_probe(environment: Mapping[str, str], probe: str = str(PROBE)) -> Dict[str, str]:
    """Returns a copy of this environment in which a Python node shows its variables."""
    folders = [probe, environment.get('PYTHONPATH', '')]
    return dict(environment, PYTHONPATH=os.pathsep.join(filter(None, folders)))
