"""A key of all that decides a trial besides the submission. Trials with equal keys end alike.

The key covers what is done to a node, the robot, and the programs that try a node. It does not
cover criteria, points and sentences, since these are made again from the recording.
"""
import ast
import hashlib
import importlib
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, List, Tuple

import rospkg

from tb3_labs.marking.intake.sandbox import OWN_PACKAGE

#: This package, and the program of its simulated robot; an installed one lies in lib.
PACKAGE, ROBOT = Path(rospkg.RosPack().get_path(OWN_PACKAGE)), 'fake_turtlebot3.py'
#: The room of marking, and the modules of the labs.
MARKING, LAB_MODULES = Path(__file__).resolve().parent, 'tb3_labs.marking.labs'


def version(lab: str) -> str:
    """A hash of all that decides the trials of a lab."""
    whole = hashlib.sha256(b''.join(path.read_bytes() for path in decisive_files(lab)))
    whole.update(repr(decisive_values()).encode())
    return whole.hexdigest()


def decisive_files(lab: str) -> List[Path]:
    """The files that decide a trial of a lab."""
    return sorted(path for path in [
        *_scripts(), *MARKING.parent.glob('simulation/*.py'), PACKAGE / 'scripts' / ROBOT,
        PACKAGE.parents[1] / 'lib' / OWN_PACKAGE / ROBOT, PACKAGE / 'launch' / 'fake_robot.launch',
        PACKAGE / 'launch' / 'checks' / f'check_{lab}.test'] if path.is_file())


def decisive_values() -> Dict[str, Any]:
    """The numbers and words of the labs that the scripts use, such as places, headings and times.
    Returns 'module name' -> value."""
    found = {'{} {}'.format(*each): getattr(importlib.import_module(each[0]), each[1], None)
             for each in _names_used()}
    return {name: value for name, value in found.items()
            if not callable(value) and not isinstance(value, ModuleType)}


@lru_cache(maxsize=None)
def _names_used() -> List[Tuple[str, str]]:
    """(Module of a lab, name in it) of all that the scripts import, sorted."""
    found = set()
    for path in _scripts():
        nodes = list(ast.walk(ast.parse(path.read_text(encoding='utf-8'))))
        imported = [(node.module or '', alias) for node in nodes
                    if isinstance(node, ast.ImportFrom) for alias in node.names]
        labs = [(module, alias) for module, alias in imported
                if module.startswith(LAB_MODULES) and '.ros_' not in module]
        found |= {(module, alias.name) for module, alias in labs if module != LAB_MODULES}
        modules = {alias.asname or alias.name: f'{module}.{alias.name}'
                   for module, alias in labs if module == LAB_MODULES}
        found |= {(modules[node.value.id], node.attr) for node in nodes
                  if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
                  and '.ros_' not in modules.get(node.value.id, '.ros_')}
    return sorted(found)


def _scripts() -> List[Path]:
    """The files that act on a node."""
    return [*MARKING.glob('trial/*.py'), *MARKING.glob('labs/ros_*.py')]
