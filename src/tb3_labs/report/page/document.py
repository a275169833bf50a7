"""Makes HTML for the pages of reports and of marks."""
import math
import re
from html import escape
from pathlib import Path
from typing import Optional, Sequence

from tb3_labs.watch.mistake import Mistake

STYLE_FILE = Path(__file__).with_name('document.css')
PAGE = '''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
{style}
</style></head><body>
<h1>{title}</h1>
{body}
</body></html>
'''
UNKNOWN_NUMBER = '\N{EN DASH}'
TAG = re.compile('<[^>]*>')
#: Finds the places at which a spreadsheet would begin a formula. A new cell may begin after a ";".
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')


class Markup(str):
    """A text that is already HTML, so it is not escaped."""


def number_text(value: float, form: str, unknown: str = UNKNOWN_NUMBER) -> str:
    """Returns the value in the format `form`, or `unknown` if it is not finite. -0 becomes 0."""
    if not math.isfinite(value):
        return unknown
    text = form.format(value)
    return form.format(0.0) if float(text) == 0.0 else text


def degrees_text(angle: float, form: str) -> str:
    """Returns the angle [rad] in degrees, in the format `form`, or a dash if it is not finite."""
    return number_text(math.degrees(angle), form)


def document(title: str, parts: Sequence[str], style: str = '') -> str:
    """Returns an HTML page with these `parts` in HTML. `style` is additional CSS."""
    style = STYLE_FILE.read_text(encoding='utf-8') + style
    return PAGE.format(title=escape(title), style=style, body='\n'.join(parts))


def table(titles: Sequence[str], rows: Sequence[Sequence[str]], text_columns: Sequence[str] = (),
          is_plain: bool = False) -> str:
    """Returns an HTML table whose columns have these `titles`. Texts are escaped. Markup is not
    escaped. The first column, and the columns whose titles are `text_columns`, are aligned left. On
    a narrow screen each cell begins with the title of its column, unless `is_plain`."""
    classes = [' class="words"' if title in text_columns else '' for title in titles]
    labels = ['' if is_plain else ' data-head="{}"'.format(TAG.sub('', _html(title)))
              for title in titles]
    lines = []
    for cells in rows:
        line = ''.join(f'<td{attributes}{label}>{_html(cell)}</td>'
                       for attributes, label, cell in zip(classes, labels, cells))
        lines.append(f'<tr>{line}</tr>')
    title_line = ''.join(f'<th{attributes}>{_html(title)}</th>'
                         for attributes, title in zip(classes, titles))
    return '<table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}\n</tbody></table>'.format(
        title_line, '\n'.join(lines))


def _html(text: str) -> str:
    return text if isinstance(text, Markup) else escape(text)


def hints_section(mistake: Optional[Mistake], sentence: str, has_timeline: bool = True) -> str:
    """Returns the HTML of three hints, or '' without a mistake. The third hint is the `sentence`. A
    hint is hidden until the student opens the previous hint."""
    if mistake is None:
        return ''
    anchor = f' <a href="#t={mistake.moment:.1f}">Watch it</a>' if has_timeline else ''
    hints = (('Hint 1: what to look at', escape(mistake.question)),
             ('Hint 2: where it is explained', escape(f'See {mistake.sheet_step}.')),
             ('The mistake', escape(sentence) + anchor))
    folded = ''
    for title, hint in reversed(hints):
        folded = f'<details><summary>{title}</summary>\n<p>{hint}</p>\n{folded}</details>\n'
    return ('<section id="hints"><h2>What went wrong</h2>\n<p>Open one hint, then try again '
            f'before you open the next.</p>\n{folded}</section>')


def safe_cell(text: str) -> str:
    """Returns the text for a cell of a spreadsheet. A "'" is added wherever the spreadsheet would
    begin a formula, because a formula from a stranger could do harm.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(r"\g<0>'", text)
