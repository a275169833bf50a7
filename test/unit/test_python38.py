"""The syntax is Python 3.8's, Noetic's, also if a newer Python runs the tests.

vermin (pip) finds uses of a newer standard library; it is too large to be a requirement:
    vermin -t=3.8- --violations --eval-annotations --feature union-types src scripts test
"""
import ast
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = sorted(path for folder in ('src', 'scripts', 'test') for path in (ROOT / folder).rglob('*.py'))


def is_python38(source):
    """Does Python 3.8 accept it? (Only for source that this Python accepts.)"""
    try:
        ast.parse(source, feature_version=(3, 8))
    except SyntaxError:
        return False
    return True


@pytest.mark.parametrize('newer', [
    'match x:\n    case 1: pass', 'try: pass\nexcept* ValueError: pass'])
def test_newer_syntax_is_noticed(newer):
    assert not is_python38(newer)


def test_all_of_it_is_python38():
    assert len(FILES) > 100
    assert [str(path.relative_to(ROOT)) for path in FILES
            if not is_python38(path.read_text(encoding='utf-8'))] == []
