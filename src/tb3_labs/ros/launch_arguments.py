"""Checks the arguments of a roslaunch.

roslaunch ignores an argument that the launch file does not know. So each launch file of this
package, and of a student's skeleton, begins with a parameter, whose value is the output of
``python3 PATH/run.py launch FILE.launch``. If an argument is unknown or missing, ``run.py`` prints
one line and fails, and roslaunch starts no node. Any Python can run this module.

rostest starts the checks of the labs. If ``run.py`` failed there, rostest would print a traceback.
So ``run.py`` succeeds, the value of the parameter is the line, and the check prints this line.
"""
import difflib
import os
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

#: The doc of an argument that contains a group of parameters shows an example, as {slip: 0.1}.
GROUP_EXAMPLE_PATTERN = re.compile(r'.*({.*})')
#: Matches a correct group of parameters. {slip:0.1} and {slip: 0,5} would crash roslaunch.
GROUP_PATTERN = re.compile(r'{\s*(\w+:\s+[^\s,}][^,}]*,?\s*)*}')
#: The doc of an argument that chooses a file shows the pattern of the files, as params/pad_*.yaml.
FILE_CHOICE_PATTERN = re.compile(r'(\w+/\w*)\*(\.\w+)')


def _program_and_words_of(process):
    """Returns 'roslaunch' or 'rostest', and the words after this name on the command line of a
    process, whose id is `process`. Returns ('', []) for another program."""
    argv = Path(f'/proc/{process}/cmdline').read_text().split('\0')[:-1]
    names = [os.path.basename(word) for word in argv[:2]]    # the first word may be python3
    for position, name in enumerate(names, start=1):
        if name in ('roslaunch', 'rostest'):
            return name, argv[position:]
    return '', []


def problem_of(argv, path):
    """Returns a sentence about the first wrong or missing argument of the launch file `path`; '' if
    all arguments are correct, or if another launch file includes `path`. `argv` is the list of
    words after `roslaunch`."""
    previous_words = ['', *argv]
    if not any(_names_launch_file(path, *words) for words in zip(previous_words, argv)):
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


def _problem_of_unknown(name, arguments, path):
    remedy = f'its arguments: roslaunch --ros-args {_package_of(path)} {path.name}'
    similar_names = difflib.get_close_matches(name, arguments, 1)
    if similar_names:
        remedy = f'is {similar_names[0]}:= meant?'
    return f'{path.name} has no argument {name}; {remedy}'


def _package_of(path):
    """Returns the name of the package whose folder contains the file; '' if there is none."""
    for folder in path.resolve().parents:
        if (folder / 'package.xml').exists():
            return ET.parse(str(folder / 'package.xml')).findtext('name').strip()
    return ''


def _names_launch_file(path, word_before, word):
    if word == path.name and word_before == _package_of(path):
        return True
    return word.endswith(path.name) and os.path.exists(word) and path.samefile(word)


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
    PROGRAM, WORDS = _program_and_words_of(os.getppid())
    PROBLEM = problem_of(WORDS, Path(sys.argv[1]))
    if PROBLEM and PROGRAM == 'rostest':
        print(PROBLEM)
    elif PROBLEM:
        sys.exit('tb3_labs: ' + PROBLEM)
