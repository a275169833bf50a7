"""The arguments of a launch file, and what is wrong with those that were typed.

roslaunch ignores an unknown argument, and takes any text for any argument. All names and values are
looked at before the file is loaded, since an error of the loading names no argument.
"""
import difflib
import os
import re
import xml.etree.ElementTree as ET
from typing import Dict, Iterator, List, NamedTuple, Tuple

import yaml

from tb3_labs.config import NOT_GIVEN
from tb3_labs.robot.turtlebot3 import MODELS

#: The launch files that robot.launch can start.
LABS = ('none', 'turn', 'move2goal', 'gamepad', 'imu_sub')
#: An argument that turns something on or off says so first; "; gazebo: ..." is one more choice.
SWITCH = re.compile(r'(true|false): ')
CLAUSE = re.compile(r'(?:^|; )(\w+): ')


class Argument(NamedTuple):
    """An argument that a launch file takes, or one of the files that it includes."""

    file: str           # name of the file that declares it
    doc: str
    switch: str         # the argument on which the inclusion of that file hangs; '' for none


def arguments_of(path: str, given: Dict[str, str]) -> Dict[str, Argument]:
    """{name: Argument} of a launch file; `given`: the values of those that were typed."""
    found: Dict[str, Argument] = {}
    _collect(path, given, '', (), found)
    return found


def _collect(path: str, given: Dict[str, str], switch: str, fixed: Tuple[str, ...],
             found: Dict[str, Argument]) -> None:
    launch = ET.parse(path).getroot()
    own = {arg.get('name', ''): arg for arg in launch.findall('arg') if arg.get('value') is None}
    for name, arg in own.items():
        if name not in fixed:
            found.setdefault(name, Argument(os.path.basename(path), arg.get('doc', ''), switch))
    for include in launch.iter('include'):
        if include.get('pass_all_args') == 'true':
            condition = _words(include.get('if', '') + include.get('unless', ''))
            names = [arg.get('name', '') for arg in include.findall('arg')]
            for file in _included(include.get('file', ''), path, given):
                _collect(file, given, switch or next((word for word in condition if word in own), ''),
                         fixed + tuple(names), found)


def _included(text: str, path: str, given: Dict[str, str]) -> Iterator[str]:
    """The launch files beside `path` that the attribute `text` of an include may mean."""
    words = _words(text)
    for word in words + [given[word] for word in words if word in given]:
        file = os.path.join(os.path.dirname(path), word + '.launch')
        if os.path.exists(file):
            yield file


def _words(text: str) -> List[str]:
    return re.findall(r'\w+', text)


def problem_of(path: str, given: Dict[str, str]) -> str:
    """What is wrong with the first of the arguments that is unknown, or not valid; '' if none is."""
    known = arguments_of(path, given)
    file = os.path.basename(path)
    for name, value in given.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            return '{}:={}: {} has no argument {}; {}'.format(
                name, value, file, name, 'is {}:= meant?'.format(near[0]) if near
                else 'its arguments: roslaunch --ros-args tb3_labs ' + file)
        reason = _invalid(name, value, known[name], os.path.dirname(path))
        if reason:
            return '{}:={} is not valid: {}'.format(name, value, reason)
    return ''


def _invalid(name: str, value: str, argument: Argument, folder: str) -> str:
    """The valid values in words if `value` is none of them, else ''."""
    if value.startswith('('):
        return 'a value in parentheses counts as not given'
    if name == 'params' or name.endswith('_params'):
        return _problem_of_yaml(value)
    valid = _choices(name, argument, folder)
    if not valid or value == NOT_GIVEN or (value.lower() if valid[0] == 'true' else value) in valid:
        return ''
    if name == 'pad':
        return 'one of {}'.format(', '.join(valid))
    return ' or '.join([', '.join(valid[:-1]), valid[-1]])


def _choices(name: str, argument: Argument, folder: str) -> List[str]:
    """The valid values of an argument, as far as it has a list of them."""
    if name == 'model':
        return list(MODELS)
    if name == 'lab':
        return list(LABS)
    if name == 'pad':
        return sorted(file[len('pad_'):-len('.yaml')]
                      for file in os.listdir(os.path.join(folder, 'params'))
                      if file.startswith('pad_') and file.endswith('.yaml'))
    if SWITCH.match(argument.doc):
        others = [word for word in CLAUSE.findall(argument.doc) if word not in ('true', 'false')]
        return ['true', 'false'] + others
    return []


def _problem_of_yaml(path: str) -> str:
    """'' or the reason why a file is no parameter file."""
    try:
        with open(path) as file:
            values = yaml.safe_load(file)
    except OSError as problem:
        return 'a YAML file; this one cannot be read ({})'.format(problem.strerror)
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        where = getattr(problem, 'problem_mark', None)
        return 'a YAML file; this one has an error{}'.format(
            ' in line {}'.format(where.line + 1) if where else '')
    if values is not None and not isinstance(values, dict):
        return 'a YAML file with lines as in launch/params: a name, a colon, a value'
    return ''


def without_effect(path: str, given: Dict[str, str], loaded: List[str]) -> str:
    """Names the first argument that belongs to a file which is not among those `loaded`, if any."""
    files = {os.path.basename(file) for file in loaded}
    for name, argument in arguments_of(path, given).items():
        if name in given and argument.file not in files:
            return '{}:={} has no effect: it belongs to {}, which is not part of this launch; see {}:='\
                .format(name, given[name], argument.file, argument.switch)
    return ''
