"""Which passages of a page are for the instructor alone? Pages are Markdown.

Such a passage stands between two lines of its own:

    <!-- instructor only -->
    <!-- end -->

In a table, a row that ends in the first of them is such a passage. A link to a page that is left
out becomes its text. A row of a table that has links to such pages and to no other goes as a whole,
and so does an image.
"""
import re
from typing import AbstractSet, Callable, List

from tb3_labs.handout.references import LINK, linked

BEGIN, END = '<!-- instructor only -->', '<!-- end -->'
#: What looks like a mark, and may be a mistyped one.
LIKE_A_MARK = re.compile(r'<!--[\s/]*(?:instructor|end\b)[^>]*-->', re.I)
CODE = re.compile(r'`[^`]*`')
FENCE = '```'


def for_students(page: str, text: str) -> str:
    """The text of a page without its marked passages; ``ValueError`` names a mark that is wrong."""
    kept: List[str] = []
    begun, cut_at = 0, -1
    for number, line in enumerate(text.splitlines(), 1):
        mark = line.strip()
        if line.startswith('|') and mark.endswith(BEGIN):
            continue
        if mark not in (BEGIN, END) and LIKE_A_MARK.search(CODE.sub('', line)):
            raise ValueError('{}:{}: a mark is {} or {}, on a line of its own'.format(
                page, number, BEGIN, END))
        if mark == BEGIN and begun or mark == END and not begun:
            raise ValueError('{}:{}: {} without {} before it'.format(
                page, number, mark, END if begun else BEGIN))
        if mark in (BEGIN, END):
            begun = number if mark == BEGIN else 0
        elif not begun and (line or cut_at != len(kept) or not kept or kept[-1]):
            kept.append(line)
        if mark == END:
            cut_at = len(kept)    # an empty line before the passage and one after it become one
    if begun:
        raise ValueError('{}:{}: {} without {} after it'.format(page, begun, BEGIN, END))
    return '\n'.join(kept) + '\n'


def without_links(page: str, text: str, gone: AbstractSet[str]) -> str:
    """The text of a page without links to the files `gone`."""
    def leads_astray(target: str) -> bool:
        return linked(page, target) in gone

    parts = text.split(FENCE)
    parts[0::2] = [_unlinked(part, leads_astray) for part in parts[0::2]]
    return FENCE.join(parts)


def _unlinked(prose: str, leads_astray: Callable[[str], bool]) -> str:
    lines = []
    for line in prose.split('\n'):
        targets = [link.group(3) for link in LINK.finditer(line)]
        gone = [leads_astray(target) for target in targets]
        if not (gone and all(gone) and (line.startswith('|') or LINK.sub('', line).strip() == ''
                                        and line.startswith('!'))):
            lines.append(line)
    return LINK.sub(lambda link: link.group(0) if not leads_astray(link.group(3)) else (
        '' if link.group(1) else link.group(2)), '\n'.join(lines))


def anchors(text: str) -> List[str]:
    """The headings of a page, as GitHub makes anchors of them."""
    headings = re.findall(r'^#+ (.*)$', ' '.join(text.split(FENCE)[0::2]), re.MULTILINE)
    return [re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings]
