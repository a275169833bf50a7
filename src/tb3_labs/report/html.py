"""Pieces of a page that needs no other file: its style, numbers, tables, pictures."""
import base64
import math
from html import escape
from typing import Sequence

#: An unknown number on a page.
DASH = '\N{EN DASH}'
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
section { break-inside: avoid; } .next { break-before: page; }
@media print { body { margin: 0; } figure img { max-height: 84mm; } }'''


PAGE = '''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title><style>
{1}
</style></head><body>
<h1>{0}</h1>
{2}
</body></html>
'''


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


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[str] = ()) -> str:
    """An HTML table of plain texts, which are escaped; Markup stays as it is.

    The first column, and those whose head is one of `words`, are aligned left, as words are.
    """
    def row(cells: Sequence[str], tag: str) -> str:
        return '<tr>{}</tr>'.format(''.join('<{0}{2}>{1}</{0}>'.format(
            tag, cell if isinstance(cell, Markup) else escape(cell),
            ' class="words"' if heads[k] in words else '') for k, cell in enumerate(cells)))
    return '<table>\n<thead>{}</thead>\n<tbody>\n{}\n</tbody></table>'.format(
        row(heads, 'th'), '\n'.join(row(cells, 'td') for cells in rows))


def document(title: str, parts: Sequence[str]) -> str:
    """A page of these parts, which are HTML."""
    return PAGE.format(escape(title), STYLE, '\n'.join(parts))


def picture(png: bytes, name: str, caption: str) -> str:
    """An HTML figure with the picture in these bytes of PNG; `name` is its alternative text."""
    data = base64.b64encode(png).decode('ascii')
    return '<figure><img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{2}</figcaption>' \
        '</figure>'.format(escape(name), data, escape(caption))
