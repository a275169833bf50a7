"""The syntax is Python 3.8's, Noetic's, also if a newer Python runs the tests.

vermin (pip) finds uses of a newer standard library; it is too large to be a requirement:
    vermin -t=3.8- --violations --eval-annotations --feature union-types src scripts test doc
"""
import ast
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = sorted(path for folder in ('src', 'scripts', 'test', 'doc') for path in (ROOT / folder).rglob('*.py'))


def test_all_of_it_is_python38():
    assert len(FILES) > 100
    for path in FILES:
        ast.parse(path.read_text(encoding='utf-8'), str(path), feature_version=(3, 8))
