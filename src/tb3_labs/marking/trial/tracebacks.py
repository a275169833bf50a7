"""The text that a node printed: its exceptions, and its last words."""
import re
from collections import Counter
from typing import List

#: A traceback begins with these words, also in the middle of a line of a log.
TRACEBACK = 'Traceback (most recent call last)'
ERROR = re.compile(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b')
FRAME = re.compile(r'^ *File "(.*)", line (\d+)(?:, in (\S+))?', re.MULTILINE)
#: Python prints this between the cause of an exception and that exception.
CHAINED = re.compile('^(During handling of|The above exception was)', re.MULTILINE)
#: Python reports a file that it cannot read without a traceback.
UNREAD = re.compile(r'(?=^ *File ".*", line \d+\n(?:.*\n){1,3}(?:Syntax|Indentation|Tab)Error:)',
                    re.MULTILINE)
#: rospy itself raises these in a callback that publishes while the node ends.
NOT_THEIRS, NOR_THIS = 'publish() to a closed topic', 'topic was closed during publish()'
#: The colours of a text on a terminal.
COLOUR = re.compile(r'\x1b\[[\d;]*m')
#: The most characters of an exception, and of a line, that are quoted.
LONGEST_ERROR, LONGEST_LINE = 160, 160


def exceptions(printed: str, file: str = '') -> List[str]:
    """The exceptions in the text, in their order: each with its line in `file`, the node's, if it
    is known, and '' for one that cannot be read. rospy's own are left out.

    For example ``NameError: name 'raw_input' is not defined (line 54, in callback_controller)``.
    """
    found = []
    pieces = printed.split(TRACEBACK)
    if len(pieces) == 1:
        pieces = UNREAD.split(printed)
    for piece in pieces[1:]:
        lines = [line for line in piece.splitlines()[1:] if line.strip()]
        error = next((line for line in lines if ERROR.match(line)), None)
        if CHAINED.search(piece):
            continue        # the next one is what ended it
        if not any(words in (error or piece) for words in (NOT_THEIRS, NOR_THIS)):
            found.append(error[:LONGEST_ERROR] + _place(piece, file) if error else '')
    return found


def _place(piece, file):
    frames = FRAME.findall(piece)
    own = [frame for frame in frames if file and frame[0].rsplit('/', 1)[-1] == file] or [
        frame for frame in frames if not frame[0].startswith(('/usr/', '/opt/', '<frozen'))]
    if not own:
        return ' (was a callback given as self.f(), not as self.f?)' if (
            "'NoneType' object is not callable" in piece) else ''    # rospy calls what it was given
    _, line, function = own[-1]
    return f" (line {line}{', in ' + function if function.isidentifier() else ''})"


def counted(errors: List[str]) -> List[str]:
    """Each exception once, in quotes, with its number if there are several of it."""
    return [repr(error) if number == 1 else f'{error!r}, {number} times'
            for error, number in Counter(errors).items()]


def last_line(printed: str) -> str:
    """The last line that a node printed, in quotes, or a clause if there is none."""
    lines = list(filter(None, map(str.strip, printed.splitlines())))
    return repr(lines[-1][:LONGEST_LINE]) if lines else 'it printed nothing'


def last_words(printed: str, file: str) -> str:
    """The last exception in the text, else its last line; see `exceptions`."""
    errors = exceptions(printed, file)
    return counted(errors[-1:])[0] if errors else last_line(printed)
