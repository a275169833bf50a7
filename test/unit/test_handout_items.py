"""test/handout_items.md: each item of the two labs has its place in this package, and its check."""
import re

import pytest
import yaml
from pages import ROOT

TABLE = (ROOT / 'test' / 'handout_items.md').read_text(encoding='utf-8')
ROW = re.compile(r'^\| (?!item \|)([^|-].*?) \| ([HCR]) \| (.*?) \| (.*?) \|$', re.MULTILINE)
PLACE = re.compile(r'`([^`]+)` "([^"]+)"')
#: Fewer than this are not all items of both labs.
LEAST = 235


def checks():
    """Names of all tests, and of the labs' criteria as turn.left."""
    names = {name for path in (ROOT / 'test').rglob('*.py')
             for name in re.findall(r'^ *def (test_\w+)', path.read_text(encoding='utf-8'), re.MULTILINE)}
    points = yaml.safe_load((ROOT / 'test' / 'marking' / 'points.yaml').read_text(encoding='utf-8'))
    return names | {'{}.{}'.format(lab, name) for lab, table in points.items()
                    for name in [*table, *table['extra']]}


def in_words(text):
    return ' '.join(text.split())


def problem(where, check, known):
    """What is wrong with a row's place or check; '' if nothing is."""
    if where.startswith('MISSING'):
        return '' if re.match(r'MISSING: \w.{10}', where) else 'it does not say why it is missing'
    if not re.fullmatch(r'({0})( {0})*'.format(PLACE.pattern.replace('(', '(?:')), where):
        return 'it is neither MISSING nor a file with words'
    for path, words in PLACE.findall(where):
        file, = [ROOT / name for name in (path, path + '.in') if (ROOT / name).is_file()] or [None]
        if file is None:
            return path + ' does not exist'
        if in_words(words) not in in_words(file.read_text(encoding='utf-8')):
            return '{} does not have "{}"'.format(path, words)
    names = re.findall('`([^`]+)`', check)
    if not names and check != 'read':
        return 'it is neither read nor checked'
    return ', '.join(name for name in names if name not in known)


def test_each_item_has_its_place_and_its_check():
    rows, known = ROW.findall(TABLE), checks()
    assert len(rows) > LEAST
    assert len(rows) == len(re.findall(r'^\| (?!item \|)', TABLE, re.MULTILINE))
    assert [(item, wrong) for item, _, where, check in rows
            for wrong in [problem(where, check, known)] if wrong] == []


@pytest.mark.parametrize('where, check, said', [
    ('MISSING', 'read', 'why'), ('somewhere', 'read', 'neither MISSING'),
    ('`no/file` "x"', 'read', 'not exist'),
    ('`setup.py` "setup" `setup.py` "no such words"', 'read', 'does not have'),
    ('`setup.py` "setup"', '', 'neither read'), ('`setup.py` "setup"', '`test_gone`', 'test_gone')])
def test_a_row_that_is_wrong_says_so(where, check, said):
    assert said in problem(where, check, {'test_there'})
