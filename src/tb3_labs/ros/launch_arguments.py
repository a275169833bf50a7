"""Checks the arguments of a roslaunch.

roslaunch ignores an argument that the launch file does not have. So each launch file of this
package begins with a parameter whose command is ``python3 PATH/run.py launch FILE.launch``. The
command reads the command line of the roslaunch that runs it. If an argument is unknown or missing,
the command prints one line and fails; then roslaunch refuses the file before a node starts. This
file imports the standard library alone, so any Python can run it.
"""
import difflib
import os
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

#: The package of the launch files.
PACKAGE = 'tb3_labs'
#: An argument may take all parameters of a node. Then its doc names the file of the parameters,
#: such as params/turtlebot3.yaml.
PARAMETERS_FILE = re.compile(r'params/\w+\.yaml')
#: An argument may choose one of several files. Then its doc names them: params/pad_*.yaml.
CHOICE_OF_FILES = re.compile(r'(\w+/\w*)\*(\.\w+)')
#: The doc of an argument that takes a file of parameters, and a line of it without a value.
OWN_FILE = 'a YAML file of your own'
NO_VALUE = re.compile(r'^(\w+):[ \t]*(?:#.*)?(?:\n(?![ \t]+\S)|\Z)', re.MULTILINE)
#: A colon without a blank after it, as in {slip:0.1}: YAML makes it a part of the name.
NO_BLANK = re.compile(r':(?!\s)')
#: An argument takes numbers if its default is one, or a group of parameters.
NUMBERS = re.compile(r'-?[\d.]+|\{\}')
#: A whole number, and the largest one that roslaunch can set on the parameter server.
WHOLE = re.compile(r'(?<![\w.+-])[+-]?\d[\d_]*(?![\w.+-])')
LARGEST = 2 ** 31 - 1
#: A parameter and its value, as in {slip: 0.1}. Behind a last comma the text may be empty.
PAIR = re.compile(r'\s*([^:]+:\s+\S.*)?')


def _words_of(process):
    """Returns the words after `roslaunch` in a process's command line; [] for another program."""
    words = Path(f'/proc/{process}/cmdline').read_text().split('\0')[:-1]
    for place, word in enumerate(words[:2]):    # the first word may be python
        if os.path.basename(word) == 'roslaunch':
            return words[place + 1:]
    return []


def problem_of(words, path):
    """Returns a sentence about the first unknown or missing argument; '' if all are right.

    `words`: the words after `roslaunch`. If they do not name the launch file `path`, another file
    includes it: then the result is '', too.
    """
    if not any(_names_file(words[:place], word, path) for place, word in enumerate(words)):
        return ''
    arguments = {item.get('name'): item for item in ET.parse(str(path)).getroot().findall('arg')
                 if item.get('value') is None}
    given = dict(word.split(':=', 1) for word in words if re.match(r'(?!__)\w+:=', word))
    for name, value in given.items():
        if name not in arguments:
            return '{}:={}: {} has no argument {}; {}'.format(
                name, value, path.name, name, _remedy(name, value, arguments, path))
        problem = _problem_of_value(name, value, arguments[name].get('doc', ''), path.parent)
        if not problem and NUMBERS.fullmatch(arguments[name].get('default', '')):
            problem = _problem_of_numbers(value)
        if problem:
            return f'{name}:={value}: {problem}'
    for name, item in arguments.items():
        if item.get('default') is None and name not in given:
            return f"{name}:= is missing: {item.get('doc')}"
    return ''


def _names_file(before, word, path):
    """Is `word`, after the words `before`, the launch file `path`?"""
    if word == path.name and before and before[-1] == PACKAGE:
        return True
    return word.endswith(path.name) and os.path.exists(word) and path.samefile(word)


def _problem_of_value(name, value, doc, folder):
    """Returns how a wrong value should be written, by the argument's `doc`; '' for a right one."""
    if PARAMETERS_FILE.search(doc):
        problem = _problem_of_group(name, value)
        if problem:
            return problem
    for start, end in CHOICE_OF_FILES.findall(doc):
        known = sorted(str(file.relative_to(folder))[len(start):-len(end)]
                       for file in folder.glob(start + '*' + end))
        if value not in known:
            return f"there is no {start}{value}{end}; {name}:= is one of {', '.join(known)}"
    return _problem_of_file(Path(value)) if doc == OWN_FILE else ''


def _problem_of_group(name, value):
    """Returns how a wrong group of parameters should be written; '' for a right one."""
    if not value.startswith('{'):
        corrected = NO_BLANK.sub(': ', '{' + value.replace('=', ':') + '}')
        return f'in braces, with colons: {name}:="{corrected}"'
    corrected = NO_BLANK.sub(': ', value)
    if corrected != value:
        return f'a blank is missing after the colon: {name}:="{corrected}"'
    for pair in value.strip('{} ').split(','):
        if not PAIR.fullmatch(pair):
            return '{!r} is not a name with a value, such as goal_x: 0.5 (with a point)'.format(
                pair.strip())
    return ''


def _problem_of_numbers(text):
    """Returns a sentence if a whole number is too large for the parameter server; else ''."""
    for word in WHOLE.findall(text):
        digits = word.replace('_', '').lstrip('+-0')
        if len(digits) > len(str(LARGEST)) or int(digits or 0) > LARGEST:
            return f'a whole number beyond {LARGEST} is not valid'
    return ''


def _problem_of_file(path):
    """Returns why roslaunch cannot read a YAML file; '' if it can, or if the file is missing."""
    try:
        text = re.sub('#.*', '', _text_of(path))
        empty = NO_VALUE.search(text)
    except ValueError:
        return 'it is not text in UTF-8: save it as UTF-8'
    return f'{empty.group(1)} has no value in it' if empty else _problem_of_numbers(text)


def _remedy(name, value, arguments, path):
    """Returns a hint for an unknown argument: which argument is meant, or how to list all."""
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
