"""The commands and promises of the pages, as steps of a student.

The info string of a block, which no reader sees, says how the block is typed:

    ```bash run                   in a new terminal, to its end, which must be a success
    ```bash run=robot             in a terminal called robot, in which it goes on
    ```bash long=robot            the same, but only by `rostest tb3_labs sheets.test all:=true`
    ```bash prepare               as run: a person has done it by then; no page says it
    ```bash never="a reason"      not typed
    ```text types=robot           these lines are typed into that terminal
    ```text then=robot            this output of that terminal appears from now on

In front of the block's commands happens, in this order: `fill=lab2/turtlebot_controller.py`, the
student has written this node; `wait=5`, nothing for so long [s]; `ends=robot`, Ctrl+C in that
terminal, which must end without a traceback.

A ``` or ```text block after a command is its output. It must appear, line after line, with other
lines between, before the next command is typed. A number of more than three digits may be another
one, and ... may be anything. A terminal that goes on is ended by Ctrl+C at the next heading, or
when another block runs in it. A `then` after a command counts from the start of that command on.
"""
import re
import shlex
from typing import Dict, NamedTuple

#: A line that is read: a heading, or the fence of a block with its info string.
MARK = re.compile(r'^ *(?:#+ (.*)|```(\w*) ?(.*))$')
#: A number that may be another one.
LONG_NUMBER = re.compile(r'-?(?:\d{4,}(?:\.\d+)?|\d+\.\d{3,})')
NUMBER = r'-?\d+(?:\.\d+)?(?:e-?\d+)?'
#: How a block is typed; the first four may have a terminal, and an output.
KINDS = ('run', 'long', 'prepare', 'then', 'types', 'never')


class Step(NamedTuple):
    """A heading or a block of a page."""

    kind: str           # 'heading', or one of KINDS
    argument: str       # the terminal, the reason of `never`, or the text of the heading
    text: str = ''      # commands, or the lines that are typed
    output: str = ''
    before: Dict[str, str] = {}     # {fill, wait or ends: value}, done before the block
    line: int = 0

    @property
    def commands(self):
        """The commands without their comments."""
        return [re.split(r'\s#\s', line)[0].strip() for line in self.text.splitlines()]


def steps_of(text):
    """Returns the Steps of a page. Raises AssertionError for a block that does not say how it is typed."""
    steps, fence, lines = [], None, []
    for number, line in enumerate(text.splitlines(), 1):
        mark = MARK.match(line)
        if fence is None:
            if mark and mark.group(1):
                steps.append(Step('heading', mark.group(1), line=number))
            elif mark:
                fence, lines = mark.groups()[1:], []
        elif line.strip() == '```':
            _add_block(steps, fence, '\n'.join(lines), number)
            fence = None
        else:
            lines.append(line.strip())
    return steps


def _add_block(steps, fence, text, number):
    """Add the Step of a block. A block without a kind is the output of the step before it."""
    language, info = fence
    words = dict(word.partition('=')[::2] for word in shlex.split(info))
    kinds = [kind for kind in KINDS if kind in words]
    assert set(words) <= {*kinds, 'fill', 'wait', 'ends'} and len(kinds) <= 1, 'line {}: {}'.format(
        number, info)
    if kinds:
        argument = words.pop(kinds[0])
        output = text if kinds[0] == 'then' else ''
        steps.append(Step(kinds[0], argument, '' if output else text, output, words, number))
    elif language == 'bash':
        raise AssertionError('line {}: the block does not say whether it is run'.format(number))
    elif language in ('', 'text') and steps and steps[-1].kind in KINDS[:3] and not steps[-1].output:
        steps[-1] = steps[-1]._replace(output=text)


def promised(output):
    """Returns a pattern of texts in which the lines of `output` appear in their order."""
    return re.compile('.*?'.join(
        _pattern_of(line) for line in output.splitlines() if line.strip(' .')), re.DOTALL)


def _pattern_of(line):
    """Returns a pattern of a line with any spaces and any long numbers. ``...`` stands for any text."""
    return NUMBER.join(
        '.*?'.join(r'\s+'.join(re.escape(word) for word in re.split(r'\s+', words))
                   for words in part.split('...'))
        for part in LONG_NUMBER.split(line.strip()))
