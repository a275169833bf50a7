"""A pad and a criterion for each lab are added to a copy as design.md describes. Then the tests that
the page names pass."""
import os
import re
import shutil
import subprocess
import sys

from pages import ROOT

import tb3_labs.msg
import tb3_labs.srv
from tb3_labs.marking.marks import LABS

CRITERION = """

def _is_polite(seen: Observation) -> str:
    return 'it was rude' if 'rude' in seen.scene('Ctrl+C', may_die=True).printed else ''


CRITERIA.append(Criterion('polite', CRITERIA[0].part, 'says nothing rude', CRITERIA[0].place,
                          _is_polite))
"""
CHANGES = """CHANGES = [
    *((lab, {'Ctrl+C': dict(good['Ctrl+C'], printed=good['Ctrl+C']['printed'] + 'rude')}, 'polite')
      for lab, good in GOOD.items()),
"""


def way_to_add(what):
    page = (ROOT / 'doc' / 'instructor' / 'design.md').read_text(encoding='utf-8')
    row, = re.findall(r'^\| {} \| (.*) \|$'.format(what), page, re.MULTILINE)
    return row


def edit(path, old, new):
    text = path.read_text(encoding='utf-8')
    assert text.count(old) == 1, (path, old)
    path.write_text(text.replace(old, new), encoding='utf-8')


def run(copy, *words):
    paths = {name: '{}:{}'.format(place, os.environ.get(name, '')) for name, place in (
        ('PYTHONPATH', copy / 'src'), ('ROS_PACKAGE_PATH', copy))}
    done = subprocess.run([sys.executable, *words], cwd=str(copy), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, universal_newlines=True, timeout=600,
                          env=dict(os.environ, PYTHONDONTWRITEBYTECODE='1', **paths))
    assert done.returncode == 0, done.stdout[-5000:]


def test_a_pad_and_criteria_are_added_as_the_page_says(tmp_path):
    copy, pad, criterion = tmp_path / 'copy', way_to_add('a pad'), way_to_add("a lab's criterion")
    shutil.copytree(str(ROOT), str(copy), ignore=shutil.ignore_patterns(
        'build', '.git', '__pycache__'))
    for made in tb3_labs.msg, tb3_labs.srv:    # generated modules are not in the sources
        copy.joinpath('src', *made.__name__.split('.')).symlink_to(made.__path__[0])

    source, new = [copy / path.replace('NAME', 'ace') for path in re.findall(
        r'`(launch/\S+)`', pad)]
    shutil.copy(str(source), str(new))
    edit(new, 'reset_button: 3', 'reset_button: 4')

    for lab in LABS:
        with (copy / 'src' / 'tb3_labs' / 'marking' / 'labs' / (lab + '.py')).open('a') as file:
            file.write(CRITERION)
        edit(copy / 'launch' / 'checks' / 'points.yaml', '\n{}:\n'.format(lab),
             '\n{}:\n  polite: 2\n'.format(lab))
    run(copy, *re.findall(r'`python3 (\S+)`', criterion))
    edit(copy / 'test' / 'unit' / 'test_criteria.py', 'CHANGES = [\n', CHANGES)

    named = set(re.findall(r'`(test/unit/test_\w+\.py)`', pad + criterion))
    assert len(named) > 1
    run(copy, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', *sorted(named))
