"""What a node does inside: its variables, what each of them follows, and its first broken link."""
import os
from pathlib import Path
from typing import Dict, Mapping

#: The folder of the probe, which has no other file.
PROBE = Path(__file__).with_name('probe')
MODULES = 'PYTHONPATH'


def watched(environment: Mapping[str, str], probe: str = str(PROBE)) -> Dict[str, str]:
    """The environment of a Python node that shows its variables, by the probe in this folder."""
    return dict(environment, **{MODULES: os.pathsep.join(
        filter(None, [probe, environment.get(MODULES)]))})
