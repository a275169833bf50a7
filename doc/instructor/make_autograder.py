#!/usr/bin/env python3
"""Makes the zip file that Gradescope's page "Configure Autograder" takes.

    python3 doc/instructor/make_autograder.py turn.zip --lab turn

The options of mark.py follow the name of the zip file. The zip file gets setup.sh, run_autograder,
the options, and the students' archive of the last commit, which has no solution.
Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.
"""
import pathlib
import subprocess
import sys
import zipfile

import one_line_errors    # noqa: F401 (it changes how Python reports the errors below)

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'scripts'))

from mark import parse    # noqa: E402 (the path is set before)

HERE = ROOT / 'doc' / 'instructor'


def make(path, options):
    """Write the zip file. An invalid option ends the program with mark.py's refusal."""
    if parse(['.', '-o', '.', *options]).points:
        sys.exit('the points come from launch/checks/points.yaml: edit and commit that file')
    files = ['--', *(HERE / 'students.txt').read_text(encoding='utf-8').split()]
    path.write_bytes(subprocess.check_output(
        ['git', 'archive', '--format=zip', '--prefix=tb3_labs/', 'HEAD', *files], cwd=str(ROOT)))
    changed = subprocess.check_output(
        ['git', 'status', '--porcelain', '-uno', *files], cwd=str(ROOT), universal_newlines=True)
    if changed:
        names = ', '.join(line[len('XY '):] for line in changed.splitlines())
        print(f'make_autograder.py: the zip file lacks these changes: {names}; commit them, and '
              'make it again', file=sys.stderr)
    texts = {file.name: file.read_text(encoding='utf-8')
             for file in (HERE / 'gradescope').iterdir()}
    texts['options'] = '\n'.join(options) + '\n'
    with zipfile.ZipFile(str(path), 'a') as archive:
        for name, text in texts.items():
            info = zipfile.ZipInfo(name)
            info.external_attr = 0o100755 << 16
            archive.writestr(info, text)


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    make(pathlib.Path(sys.argv[1]), sys.argv[2:])
