"""How alike are two programs, however their names and comments were changed?

A text becomes the set of its shingles: runs of LENGTH tokens in a row, without comments and
docstrings, strings and numbers without their values, and names by the order in which a run uses
them. The likeness of two texts is the share of the smaller set that the other set has too.

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
#: skeleton: turtlebot_controller.py of three real teams was alike by 0.50, 0.53 and 0.69. A copy of
#: one with other names, other strings, other comparisons and its methods in another order was alike
#: by 0.85, and one with other names alone by 1.
NEARLY_SAME = 0.8
#: A text with fewer shingles is that of everybody. Without those of the skeletons, the handouts'
#: nodes have 80 (IMU exercise; 160 with it), 105 (gamepad), 274 (move to goal) and 352 (turns).
FEWEST = 200
IGNORED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
           tokenize.ENCODING, tokenize.ENDMARKER)
Shingles = FrozenSet[Tuple[str, ...]]


def tokens_of(code: str) -> List[str]:
    """The tokens of a program: keywords and operators as they are; 0 for a number, '' for a string,
    and names as they are, with a blank in front."""
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
    """A run of tokens, with its names called 1, 2, ... in their order."""
    known: Dict[str, str] = {}
    return tuple(known.setdefault(token, 'name{}'.format(len(known) + 1))
                 if token.startswith(' ') else token for token in tokens)


def likeness(one: Shingles, other: Shingles) -> float:
    """The share of the smaller set that the other one has too, from 0 to 1; 0 if one has fewer than
    FEWEST."""
    smaller = min(len(one), len(other))
    return len(one & other) / smaller if smaller >= FEWEST else 0.0


def nearly_same(submitted: Mapping[str, str], published: Mapping[str, str],
                given: Iterable[str] = ()) -> List[Tuple[str, str, float]]:
    """(one, other, likeness) of each pair that is nearly the same, the most alike first.

    `submitted` and `published`: name -> program; the latter are not compared among themselves.
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
