"""What decides a trial besides the submission: with the same, another trial would end alike.

It is what is done to a node, the robot, and the programs that try a node. Criteria, points and
sentences are not among it: they are made anew from the recording.
"""
import ast
import hashlib
import importlib
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, List

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
        PACKAGE / 'launch' / 'checks' / 'check_{}.test'.format(lab)] if path.is_file())


def decisive_values() -> Dict[str, Any]:
    """The numbers and words of the labs that the scripts use: places, headings, times; 'module
    name' -> value."""
    found: Dict[str, Any] = {}
    for path in _scripts():
        nodes = list(ast.walk(ast.parse(path.read_text(encoding='utf-8'))))
        modules: Dict[str, ModuleType] = {}
        for node in nodes:
            name = node.module or '' if isinstance(node, ast.ImportFrom) else ''
            if name.startswith(LAB_MODULES) and '.ros_' not in name:
                module = importlib.import_module(name)
                for alias in node.names if isinstance(node, ast.ImportFrom) else ():
                    value = getattr(module, alias.name, None)
                    if isinstance(value, ModuleType):
                        modules[alias.asname or alias.name] = value
                    found['{} {}'.format(name, alias.name)] = value
        for node in nodes:
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and (
                    node.value.id in modules):
                module = modules[node.value.id]
                found['{} {}'.format(module.__name__, node.attr)] = getattr(module, node.attr)
    return {name: value for name, value in sorted(found.items())
            if not callable(value) and not isinstance(value, ModuleType)}


def _scripts() -> List[Path]:
    """The files that act on a node."""
    return [*MARKING.glob('trial/*.py'), *MARKING.glob('labs/ros_*.py')]
