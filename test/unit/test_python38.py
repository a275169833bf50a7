"""The syntax is Python 3.8's, Noetic's, whatever Python runs the tests.

What only a newer standard library has is found by vermin (pip), too large to be a requirement:
    vermin -t=3.8- --violations --eval-annotations --feature union-types src scripts test
"""
import ast
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = sorted(path for folder in ('src', 'scripts', 'test') for path in (ROOT / folder).rglob('*.py'))


def is_python38(source):
    """Does Python 3.8 accept it? (To be asked of what this Python accepts.)"""
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
