"""How alike are two programs, even if names and comments were changed?

A program becomes the set of its shingles: runs of LENGTH tokens in a row. Comments and docstrings
are left out. Strings and numbers lose their values. Names are numbered in the order in which a run
uses them. The likeness of two programs is the share of the smaller set that is also in the other.

Source: k-gram fingerprints as in Schleimer, Wilkerson, Aiken, "Winnowing: local algorithms for
document fingerprinting", SIGMOD 2003; all k-grams are kept, since these texts are short.
"""
import io
import itertools
import keyword
import tokenize
from typing import Dict, FrozenSet, Iterable, List, Mapping, Sequence, Tuple

#: Tokens in a shingle, about two lines.
LENGTH = 16
#: Texts that are as alike as this are nearly the same. The handout gives everybody the same
#: skeleton: turtlebot_controller.py of three real teams was alike by 0.50, 0.53 and 0.69. A copy
#: with other names, other strings, other comparisons and its methods in another order was alike by
#: 0.85. A copy with only other names was alike by 1.
NEARLY_SAME = 0.8
#: A text with fewer shingles is too short to compare: all students write the same. Without the
#: shingles of the skeletons, the handouts' nodes have 80 (IMU exercise; 160 with its skeleton), 105
#: (gamepad), 274 (move to goal) and 352 (turns).
FEWEST = 200
IGNORED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
           tokenize.ENCODING, tokenize.ENDMARKER)
Shingles = FrozenSet[Tuple[str, ...]]


def tokens_of(code: str) -> List[str]:
    """Returns the tokens of a program.

    Keywords and operators are unchanged. A number becomes 0, a string becomes ''. A name gets a
    blank in front.
    """
    found, begins_line = [], True
    try:
        for kind, text, _, _, _ in tokenize.generate_tokens(io.StringIO(code).readline):
            if kind not in IGNORED and not (kind == tokenize.STRING and begins_line):
                found.append(_plain(text, kind == tokenize.STRING))
            begins_line = kind in IGNORED and (begins_line or kind != tokenize.COMMENT)
    except (tokenize.TokenError, SyntaxError):
        pass        # not valid Python; the tokens up to there are enough
    return found


def _plain(text: str, is_string: bool) -> str:
    if is_string:
        return "''"
    if text[0].isdigit() or text[0] == '.' and text[1:2].isdigit():
        return '0'
    return ' ' + text if text.isidentifier() and not keyword.iskeyword(text) else text


def shingles(code: str) -> Shingles:
    """The shingles of a program."""
    tokens = tokens_of(code)
    return frozenset(_renamed(tokens[begin:begin + LENGTH])
                     for begin in range(len(tokens) - LENGTH + 1))


def _renamed(tokens: Sequence[str]) -> Tuple[str, ...]:
    """Returns a run of tokens; its names are replaced by name1, name2, ... in their order."""
    known: Dict[str, str] = {}
    return tuple(known.setdefault(token, 'name{}'.format(len(known) + 1))
                 if token.startswith(' ') else token for token in tokens)


def likeness(one: Shingles, other: Shingles) -> float:
    """Returns the share of the smaller set that is also in the other one, from 0 to 1.

    Returns 0 if one set has fewer than FEWEST shingles.
    """
    smaller = min(len(one), len(other))
    return len(one & other) / smaller if smaller >= FEWEST else 0.0


def nearly_same(submitted: Mapping[str, str], published: Mapping[str, str],
                given: Iterable[str] = ()) -> List[Tuple[str, str, float]]:
    """Returns (one, other, likeness) of each pair that is nearly the same, the most alike first.

    `submitted`, `published`: name -> program. Published programs are not compared with each other.
    `given`: programs that every student was given; their shingles do not count.
    """
    common = frozenset().union(*(shingles(code) for code in given))
    students, others = ([(name, shingles(code) - common) for name, code in sorted(texts.items())]
                        for texts in (submitted, published))
    found = [(one, other, likeness(first, second))
             for (one, first), (other, second) in itertools.chain(
                 itertools.combinations(students, 2), itertools.product(students, others))]
    return sorted((pair for pair in found if pair[2] >= NEARLY_SAME),
                  key=lambda pair: -pair[2])
