"""The signs of a mistake in the node itself: its exceptions, its open TODOs, its first broken link.

The link is shown by hints, each folded, and the next one within it. So a teacher can hand out the
page of a run, and the student still has to find the mistake.
"""
import re
from html import escape
from typing import Callable, Dict, List, Optional, Tuple

from tb3_labs.report.run_data import RunData
from tb3_labs.watch.broken_link import BrokenLink, sentence
from tb3_labs.watch.chains import Link, found_in

#: rospy's words before a traceback of a callback, and the line that it names.
RAISED, LINE_NUMBER = ('Traceback (most recent call last)', 'bad callback'), re.compile(
    r'^ *File ".*", line (\d+)', re.MULTILINE)
#: A page shows this many different exceptions, and of each this many characters.
MOST_ERRORS, LONGEST_ERROR = 5, 300
#: The skeletons' nodes print the name of each TODO that they reach.
OPEN_TODO = re.compile(r'TODO \d+ is open')
PRINTED = '<p><b>{}</b> <a href="#t={:.1f}">Watch it</a></p>'
FOLDED = '<details><summary>{}</summary>\n<p>{}</p>\n{}</details>\n'


def printed_faults(run: RunData) -> str:
    """HTML of the faults that the node itself printed: exceptions, each once, and open TODOs."""
    log = run.log
    errors: Dict[str, List[float]] = {}
    for time, text in zip(log.time, log.texts):
        if any(word in text for word in RAISED):
            at = LINE_NUMBER.findall(text)
            words = text.strip().splitlines()[-1] + (f' (line {at[-1]})' if at else '')
            errors.setdefault(words, []).append(float(time))
    parts = [PRINTED.format(escape('An exception came {}: {}.'.format(
        'once' if len(times) == 1 else '{} times'.format(len(times)), words[:LONGEST_ERROR])),
           times[0]) for words, times in list(errors.items())[:MOST_ERRORS]]
    todos = [(float(time), found.group()) for time, text in zip(log.time, log.texts)
             for found in [OPEN_TODO.match(text)] if found]
    if todos:
        parts.append(PRINTED.format('The node said: {}.'.format(', '.join(dict.fromkeys(
            words for _, words in todos))), todos[0][0]))
    return '\n'.join(parts)


def sections(run: RunData) -> List[str]:
    """HTML of the first broken link of each node whose variables were recorded."""
    return [section((link, broken), f'{node}: {sentence(broken)}')
            for node, link, broken in found_in(run)]


def section(found: Optional[Tuple[Link, BrokenLink]], words: str,
            linked: Callable[[str], str] = escape) -> str:
    """HTML of a broken link, in these `words`; '' if there is none. ``linked(text)``:
    HTML of a text."""
    if found is None:
        return ''
    link, broken = found
    mistake = FOLDED.format('The mistake', '{} <a href="#t={:.1f}">Watch it</a>'.format(
        escape(words), broken.moment), '')
    return '<section id="hints"><h2>What went wrong</h2>\n<p>Open one hint, then try again ' \
        'before you open the next.</p>\n{}</section>'.format(FOLDED.format(
            'Hint 1: what to look at', escape(link.question), FOLDED.format(
                'Hint 2: where it is explained', linked('See {}.'.format(link.place)), mistake)))
