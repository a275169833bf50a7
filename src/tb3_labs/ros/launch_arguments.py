"""Checks the arguments of a roslaunch.

roslaunch ignores an argument that the launch file does not have. So each launch file of this
package begins with a parameter whose command is ``python3 PATH/run.py launch FILE.launch``. The
command reads the command line of its roslaunch. If an argument is unknown or missing, the command
prints one line and fails. Then roslaunch refuses the file before a node starts. This module imports
only the standard library, so any Python can run it.
"""
import difflib
import os
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

#: The package of the launch files.
PACKAGE = 'tb3_labs'
#: If an argument takes a group of parameters, its doc names their file: params/turtlebot3.yaml.
PARAMETERS_FILE = re.compile(r'params/\w+\.yaml')
#: If an argument chooses a file, its doc has the pattern of the files: params/pad_*.yaml.
CHOICE_OF_FILES = re.compile(r'(\w+/\w*)\*(\.\w+)')
#: If an argument takes the path of a user's own file, this is its doc.
OWN_FILE_DOC = 'a YAML file of your own'
#: A parameter without a value in a YAML file.
EMPTY_PARAMETER = re.compile(r'^(\w+):[ \t]*(?:#.*)?(?:\n(?![ \t]+\S)|\Z)', re.MULTILINE)
#: A colon that no blank follows, as in {slip:0.1}. YAML reads this colon as a part of the name.
NO_BLANK = re.compile(r':(?!\s)')
#: An argument with one of these defaults takes numbers: a number, or an empty group of parameters.
NUMERIC_DEFAULT = re.compile(r'-?[\d.]+|\{\}')
WHOLE_NUMBER = re.compile(r'(?<![\w.+-])[+-]?\d[\d_]*(?![\w.+-])')
#: roslaunch cannot set a larger whole number on the parameter server.
LARGEST_WHOLE_NUMBER = 2 ** 31 - 1
#: A parameter and its value, as in {slip: 0.1}; or the empty text after a last comma.
NAME_AND_VALUE = re.compile(r'\s*([^:]+:\s+\S.*)?')


def _words_of(process):
    """Returns the words after `roslaunch` on the command line of a process; [] if the process is
    not a roslaunch."""
    argv = Path(f'/proc/{process}/cmdline').read_text().split('\0')[:-1]
    for number, word in enumerate(argv[:2], 1):    # the first word may be python3
        if os.path.basename(word) == 'roslaunch':
            return argv[number:]
    return []


def problem_of(argv, path):
    """Returns a sentence about the first wrong or missing argument of the launch file `path`; '' if
    all arguments are right. `argv` has the words after `roslaunch`.

    If `argv` does not name `path`, another launch file includes it. Then it is not checked.
    """
    if not any(_is_file(path, *pair) for pair in zip(['', *argv], argv)):
        return ''
    arguments = {item.get('name'): item for item in ET.parse(str(path)).getroot().findall('arg')
                 if item.get('value') is None}
    given = dict(word.split(':=', 1) for word in argv if re.match(r'(?!__)\w+:=', word))
    for name, value in given.items():
        if name not in arguments:
            return '{}:={}: {} has no argument {}; {}'.format(
                name, value, path.name, name, _remedy(name, value, arguments, path))
        problem = _problem_of_value(name, value, arguments[name].get('doc', ''), path.parent)
        if not problem and NUMERIC_DEFAULT.fullmatch(arguments[name].get('default', '')):
            problem = _problem_of_numbers(value)
        if problem:
            return f'{name}:={value}: {problem}'
    for name, item in arguments.items():
        if item.get('default') is None and name not in given:
            return f"{name}:= is missing: {item.get('doc')}"
    return ''


def _is_file(path, word_before, word):
    """Does `word`, after the word `word_before`, name the launch file `path`?"""
    if word == path.name and word_before == PACKAGE:
        return True
    return word.endswith(path.name) and os.path.exists(word) and path.samefile(word)


def _problem_of_value(name, value, doc, folder):
    """Returns the correction of a wrong value; '' if the value is right. The `doc` of the argument
    `name` shows which values are right. `folder` has the launch files."""
    if PARAMETERS_FILE.search(doc):
        problem = _problem_of_group(name, value)
        if problem:
            return problem
    for start, end in CHOICE_OF_FILES.findall(doc):
        known = sorted(str(file.relative_to(folder))[len(start):-len(end)]
                       for file in folder.glob(start + '*' + end))
        if value not in known:
            return f"there is no {start}{value}{end}; {name}:= is one of {', '.join(known)}"
    return _problem_of_file(Path(value)) if doc == OWN_FILE_DOC else ''


def _problem_of_group(name, value):
    """Returns the correction of a wrong group of parameters; '' if the group is right."""
    if not value.startswith('{'):
        corrected = NO_BLANK.sub(': ', '{' + value.replace('=', ':') + '}')
        return f'in braces, with colons: {name}:="{corrected}"'
    corrected = NO_BLANK.sub(': ', value)
    if corrected != value:
        return f'a blank is missing after the colon: {name}:="{corrected}"'
    for pair in value.strip('{} ').split(','):
        if not NAME_AND_VALUE.fullmatch(pair):
            return '{!r} is not a name with a value, such as goal_x: 0.5 (with a point)'.format(
                pair.strip())
    return ''


def _problem_of_numbers(text):
    """Returns a sentence if a whole number is too large for the parameter server; '' otherwise."""
    for word in WHOLE_NUMBER.findall(text):
        digits = word.replace('_', '').lstrip('+-0')
        if len(digits) > len(str(LARGEST_WHOLE_NUMBER)) or int(digits or 0) > LARGEST_WHOLE_NUMBER:
            return f'a whole number beyond {LARGEST_WHOLE_NUMBER} is not valid'
    return ''


def _problem_of_file(path):
    """Returns why roslaunch cannot read a YAML file; '' if it can. A missing file also gives '',
    because roslaunch itself reports it."""
    try:
        text = re.sub('#.*', '', _text_of(path))
        empty = EMPTY_PARAMETER.search(text)
    except ValueError:
        return 'it is not text in UTF-8: save it as UTF-8'
    return f'{empty.group(1)} has no value in it' if empty else _problem_of_numbers(text)


def _remedy(name, value, arguments, path):
    """Returns a hint for an unknown argument: the argument that is probably meant, or the command
    that lists all arguments."""
    known = {other: other + ':=' for other in arguments}
    for argument, item in arguments.items():
        for file in PARAMETERS_FILE.findall(item.get('doc', '')):
            for parameter in _parameters_in(path.parent / file):
                known.setdefault(parameter, f'{argument}:="{{{parameter}: {value}}}"')
    if name in known:
        return known[name]
    for near in difflib.get_close_matches(name, known, 1):
        return f'is {known[near]} meant?'
    return f'its arguments: roslaunch --ros-args {PACKAGE} {path.name}'


def _parameters_in(file):
    return re.findall(r'^#?(\w+):', _text_of(file), re.MULTILINE)


def _text_of(file):
    return file.read_text(encoding='utf-8') if file.is_file() else ''


if __name__ == '__main__':
    PROBLEM = problem_of(_words_of(os.getppid()), Path(sys.argv[1]))
    sys.exit('tb3_labs: ' + PROBLEM if PROBLEM else 0)
