"""Checks the arguments of a roslaunch.

roslaunch ignores an argument that the launch file does not know. So each launch file of this
package begins with a parameter, whose value is the output of ``python3 PATH/run.py launch
FILE.launch``. If an argument is unknown or missing, ``run.py`` prints one line and fails. Then
roslaunch starts no node. This module imports only Python's own modules, so any Python can run it.
"""
import difflib
import os
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

PACKAGE = 'tb3_labs'
#: The doc of an argument that contains a group of parameters shows an example, as {slip: 0.1}.
GROUP_EXAMPLE_PATTERN = re.compile(r'.*({.*})')
#: Matches a correct group of parameters. {slip:0.1} and {slip: 0,5} would crash roslaunch.
GROUP_PATTERN = re.compile(r'{\s*(\w+:\s+[^\s,}][^,}]*,?\s*)*}')
#: The doc of an argument that chooses a file shows the pattern of the files, as params/pad_*.yaml.
FILE_CHOICE_PATTERN = re.compile(r'(\w+/\w*)\*(\.\w+)')


def _words_of(process):
    """Returns the words after `roslaunch` on the command line of a process, whose id is `process`.
    Returns [] for a process that is not a roslaunch."""
    argv = Path(f'/proc/{process}/cmdline').read_text().split('\0')[:-1]
    names = [os.path.basename(word) for word in argv[:2]]    # the first word may be python3
    if 'roslaunch' not in names:
        return []
    return argv[names.index('roslaunch') + 1:]


def problem_of(argv, path):
    """Returns a sentence about the first wrong or missing argument of the launch file `path`; '' if
    all arguments are correct, or if another launch file includes `path`. `argv` is the list of
    words after `roslaunch`."""
    if not _starts_launch_file(argv, path):
        return ''
    arguments = {item.get('name'): item for item in ET.parse(str(path)).getroot().findall('arg')
                 if item.get('value') is None}
    # a word such as __name:=value is for roslaunch itself
    given_values = dict(word.split(':=', 1) for word in argv if re.match(r'(?!__)\w+:=', word))

    for name, value in given_values.items():
        if name in arguments:
            problem = _problem_of_value(name, value, arguments[name].get('doc', ''), path.parent)
        else:
            problem = _problem_of_unknown(name, arguments, path)
        if problem:
            return f'{name}:={value}: {problem}'
    for name, item in arguments.items():
        if item.get('default') is None and name not in given_values:
            return f"{name}:= is missing: {item.get('doc')}"
    return ''


def _starts_launch_file(argv, path):
    """Returns True if `argv` contains the path of the launch file, or the package and its name."""
    if (PACKAGE, path.name) in zip(argv, argv[1:]):
        return True
    return any(word.endswith(path.name) and os.path.exists(word) and path.samefile(word)
               for word in argv)


def _problem_of_unknown(name, arguments, path):
    remedy = f'its arguments: roslaunch --ros-args {PACKAGE} {path.name}'
    similar_names = difflib.get_close_matches(name, arguments, 1)
    if similar_names:
        remedy = f'is {similar_names[0]}:= meant?'
    return f'{path.name} has no argument {name}; {remedy}'


def _problem_of_value(name, value, doc, folder):
    """Returns a sentence that corrects a wrong value; '' if the value is valid. The text `doc` of
    the argument shows which values are valid. `folder` contains the launch file."""
    example = GROUP_EXAMPLE_PATTERN.match(doc)
    if example and not GROUP_PATTERN.fullmatch(value):
        return ('parameters are given in braces, with a blank after each colon, and a point in '
                f'numbers: {name}:="{example.group(1)}"')
    for start, end in FILE_CHOICE_PATTERN.findall(doc):
        prefix = os.path.basename(start)
        choices = sorted(file.stem[len(prefix):] for file in folder.glob(f'{start}*{end}'))
        if value not in choices:
            return f"there is no {start}{value}{end}; {name}:= is one of {', '.join(choices)}"
    return ''


if __name__ == '__main__':
    PROBLEM = problem_of(_words_of(os.getppid()), Path(sys.argv[1]))
    if PROBLEM:
        sys.exit('tb3_labs: ' + PROBLEM)
