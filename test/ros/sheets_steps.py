"""What the pages tell to type, and what they promise: their text as steps of a student.

A comment before each block of commands says how it is typed:

    <!-- run -->                  in a new terminal, to its end, which must be a success
    <!-- run: robot -->           in a terminal called robot, in which it goes on
    <!-- long: robot -->          the same, but only by `rostest tb3_labs sheets.test all:=true`
    <!-- then: robot, types: l --> a line is typed into that terminal; only its output counts that comes from now on
    <!-- ends: robot -->          Ctrl+C in that terminal; it must end without a traceback
    <!-- wait: 5 -->              nothing for so long [s]
    <!-- prepare -->              what a person has done by then; no page says it
    <!-- not run: reason -->      not here
    <!-- fill in: lab2 turtlebot_controller.py -->    the student has written this node

The block of output after any of the first four must appear, line after line, with other lines
between, before the next command is typed. A number of more than three digits may be another one,
and ... may be anything. A terminal that goes on is ended by Ctrl+C at the next heading, or when
another block runs in it. A `then` after a command counts from the start of that command on.
"""
import re
from typing import NamedTuple

#: A line that matters: heading, directive, or the fence of a block.
MARK = re.compile(r'^ *(?:(#+) (.*)|<!-- (run|long|then|ends|wait|prepare|not run|fill in)(?:: (.*?))? -->|```(\w*))$')
#: Directives that are steps by themselves, and steps that are left out if the command before them was.
ALONE, FOLLOWING = ('fill in', 'then', 'ends', 'wait'), ('then', 'ends', 'wait', 'prepare', 'not run')
#: A number that may be another one.
LONG_NUMBER, NUMBER = re.compile(r'-?(?:\d{4,}(?:\.\d+)?|\d+\.\d{3,})'), r'-?\d+(?:\.\d+)?(?:e-?\d+)?'
#: Steps that a block of output may follow.
WITH_OUTPUT = ('run', 'long', 'prepare', 'then')


class Step(NamedTuple):
    """A heading (its text), a node to fill in (package and file), or a block of commands."""

    kind: str           # heading, run, long, then, ends, wait, prepare, not run, fill in
    argument: str
    commands: str = ''
    output: str = ''
    line: int = 0


def steps_of(text):
    """The Steps of a page; AssertionError for commands without a directive."""
    steps, fence, directive = [], None, None
    for number, line in enumerate(text.splitlines(), 1):
        mark = MARK.match(line)
        if fence is not None:
            if mark and mark.group(5) == '':
                _add_block(steps, fence, directive, number)
                fence, directive = None, None
            else:
                fence[1].append(line.strip())
        elif mark and mark.group(1):
            steps.append(Step('heading', mark.group(2), line=number))
        elif mark and mark.group(3) in ALONE:
            steps.append(Step(mark.group(3), mark.group(4), line=number))
        elif mark and mark.group(3):
            directive = mark.group(3), mark.group(4) or ''
        elif mark:
            fence = mark.group(5), []
    return steps


def _add_block(steps, fence, directive, number):
    """Add a block's Step, or its text as the output of the step before it."""
    language, lines = fence
    if language == 'bash':
        assert directive, 'line {}: the block does not say whether it is run'.format(number)
        steps.append(Step(directive[0], directive[1], '\n'.join(lines), line=number))
    elif not language and steps and steps[-1].kind in WITH_OUTPUT and not steps[-1].output:
        steps[-1] = steps[-1]._replace(output='\n'.join(lines))


def promised(output):
    """A pattern of a text in which the lines of `output` appear, in their order."""
    return re.compile('.*?'.join(
        _pattern_of(line) for line in output.splitlines() if line.strip(' .')), re.DOTALL)


def _pattern_of(line):
    """A pattern of a line, with any space between its words, and any long numbers; ``...`` stands
    for anything."""
    return NUMBER.join(
        '.*?'.join(r'\s+'.join(re.escape(word) for word in re.split(r'\s+', words))
                   for words in part.split('...'))
        for part in LONG_NUMBER.split(line.strip()))


def without_comment(line):
    """A command as the shell takes it: without the comment behind it."""
    return re.split(r'\s#\s', line)[0].strip()
