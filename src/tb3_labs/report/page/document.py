"""Makes HTML for the pages of reports and of marks."""
import math
import re
from html import escape
from pathlib import Path
from typing import Optional, Sequence, Tuple

from tb3_labs.watch.broken_link import BrokenLink
from tb3_labs.watch.lab_links import Link

STYLE = Path(__file__).with_name('document.css')
PAGE = '''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
{1}
</style></head><body>
<h1>{0}</h1>
{2}
</body></html>
'''
FOLDED = '<details><summary>{}</summary>\n<p>{}</p>\n{}</details>\n'
#: This text stands for an unknown number.
DASH = '\N{EN DASH}'
TAG = re.compile('<[^>]*>')
#: Finds the places at which a spreadsheet would begin a formula. A spreadsheet may also begin a new
#: cell at a semicolon.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')


class Markup(str):
    """A text in HTML, which is not escaped."""


def formatted(value: float, form: str, unknown: str = DASH) -> str:
    """Returns the value in the format `form`, or `unknown` if the value is not finite. A zero never
    has a minus sign."""
    if not math.isfinite(value):
        return unknown
    text = form.format(value)
    return text if float(text) else form.format(0.0)


def degrees(angle: float, form: str) -> str:
    """Returns the angle [rad] in degrees, in the format `form`; a dash if not finite."""
    return formatted(math.degrees(angle), form)


def document(title: str, parts: Sequence[str], style: str = '') -> str:
    """Returns an HTML page with these `parts`, which are HTML. `style` is additional CSS."""
    style = STYLE.read_text(encoding='utf-8') + style
    return PAGE.format(escape(title), style, '\n'.join(parts))


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], texts: Sequence[str] = (),
          is_plain: bool = False) -> str:
    """Returns an HTML table. Texts are escaped. Markup is not escaped.

    `texts` are the heads of the columns that are aligned left, in addition to the first column. On
    a narrow screen each cell begins with the head of its column, unless `is_plain`.
    """
    attributes = [' class="words"' if head in texts else '' for head in heads]
    headings = [TAG.sub('', _html(head)) for head in heads]
    lines = []
    for cells in rows:
        line = ''
        for attribute, heading, cell in zip(attributes, headings, cells):
            label = '' if is_plain else f' data-head="{heading}"'
            line += f'<td{attribute}{label}>{_html(cell)}</td>'
        lines.append(f'<tr>{line}</tr>')
    first = ''.join(f'<th{attribute}>{_html(head)}</th>'
                    for attribute, head in zip(attributes, heads))
    return '<table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}\n</tbody></table>'.format(
        first, '\n'.join(lines))


def _html(text: str) -> str:
    return text if isinstance(text, Markup) else escape(text)


def hints(found: Optional[Tuple[Link, BrokenLink]], mistake: str,
          has_timeline: bool = True) -> str:
    """Returns the HTML of three hints; '' if `found` is None. The hints are the link's question,
    the place in a lab sheet that explains the link, and the sentence `mistake`. A hint is hidden
    until the previous hint is open, so a student sees no more hints than needed."""
    if found is None:
        return ''
    link, broken = found
    watch = f' <a href="#t={broken.moment:.1f}">Watch it</a>' if has_timeline else ''
    last = FOLDED.format('The mistake', escape(mistake) + watch, '')
    second = FOLDED.format('Hint 2: where it is explained', escape(f'See {link.place}.'), last)
    return '<section id="hints"><h2>What went wrong</h2>\n<p>Open one hint, then try again ' \
        'before you open the next.</p>\n{}</section>'.format(FOLDED.format(
            'Hint 1: what to look at', escape(link.question), second))


def safe(text: str) -> str:
    """Returns the text for a cell of a spreadsheet. A "'" is added at each place where the
    spreadsheet would begin a formula.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)
