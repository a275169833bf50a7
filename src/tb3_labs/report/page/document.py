"""The HTML of the pages of reports and of marks: a document, a table, the texts of cells.

An unknown value is a dash.
"""
import math
import re
from html import escape
from typing import Sequence

#: The style of a page of tables.
STYLE = '''@page { size: A4; margin: 11mm 14mm; }
body { font: 10pt/1.3 sans-serif; max-width: 182mm; margin: 1em auto; color: #111; }
h1 { font-size: 15pt; margin: 0; } h2 { font-size: 11pt; margin: 0.7em 0 0.2em; }
p { margin: 0.3em 0; }
table { border-collapse: collapse; width: 100%; font-size: 8.5pt; }
th, td { border-bottom: 1px solid #999; padding: 1px 5px; text-align: right; }
th { border-bottom: 2px solid #333; vertical-align: bottom; }
th:first-child, td:first-child, .words { text-align: left; }
figure { margin: 0.4em 0; text-align: center; break-inside: avoid; }
figure img { max-width: 100%; } figcaption { font-size: 8.5pt; }
details { margin: 0.3em 0; } details details { margin-left: 1.2em; }
summary { cursor: pointer; font-weight: bold; }
section { break-inside: avoid; } .next { break-before: page; }
@media screen {
  body { padding: 0 12px; max-width: 1156px; } p, details { max-width: 48em; }
  pre { white-space: pre-wrap; overflow-wrap: anywhere; }
  table { max-width: 760px; } figure { text-align: left; }
  figure img { max-width: min(100%, 760px); }
}
@media print { body { margin: 0; } figure img { max-height: 84mm; } }'''
#: On a narrow screen a row is a paragraph, so that no column is cut off.
NARROW = '''
@media screen and (max-width: 760px) {
  table, tbody, tr { display: block; } thead { display: none; }
  tr { border-bottom: 1px solid #999; padding: 3px 0; }
  td { display: inline-block; border: 0; padding: 0 10px 0 0; text-align: left; }
  td.words { display: block; } td::before { content: attr(data-head) ' '; color: #666; }
  td:empty { display: none; }
  figure { overflow-x: auto; } figure img { max-width: none; width: 760px; }
}'''
PAGE = '''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
{1}
</style></head><body>
<h1>{0}</h1>
{2}
</body></html>
'''
#: An unknown number on a page.
DASH = '\N{EN DASH}'
TAG = re.compile('<[^>]*>')
#: A spreadsheet would begin a formula here, in cells separated by commas or by semicolons.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')


class Markup(str):
    """Text that already is HTML."""


def number(value: float, form: str, unknown: str = DASH) -> str:
    """The value in this format, but never -0.00; `unknown` if it is not finite."""
    if not math.isfinite(value):
        return unknown
    text = form.format(value)
    return text if float(text) else form.format(0.0)


def degrees(angle: float, form: str) -> str:
    """The angle [rad] in degrees, in this format, or a dash."""
    return number(math.degrees(angle), form)


def document(title: str, parts: Sequence[str], style: str = '') -> str:
    """Returns an HTML page of these parts, which are HTML too; `style`: more CSS."""
    return PAGE.format(escape(title), STYLE + style + NARROW, '\n'.join(parts))


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[str] = (),
          is_plain: bool = False) -> str:
    """Returns an HTML table. Plain texts are escaped; Markup stays as it is.

    The first column, and each column with its head in `words`, are aligned left. On a narrow screen
    each cell has its head beside it, unless the cells say enough (`is_plain`).
    """
    def row(cells: Sequence[str], tag: str) -> str:
        return '<tr>{}</tr>'.format(''.join('<{0}{2}{3}>{1}</{0}>'.format(
            tag, html(cell), ' class="words"' if heads[k] in words else '',
            ' data-head="{}"'.format(TAG.sub('', html(heads[k]))) if tag == 'td' and not (
                is_plain) else '')
            for k, cell in enumerate(cells)))

    def html(text: str) -> str:
        return text if isinstance(text, Markup) else escape(text)
    return '<table>\n<thead>{}</thead>\n<tbody>\n{}\n</tbody></table>'.format(
        row(heads, 'th'), '\n'.join(row(cells, 'td') for cells in rows))


def safe(text: str) -> str:
    """Returns the text of a cell, with a "'" in front if a spreadsheet would read it as a formula.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)
