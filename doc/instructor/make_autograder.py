#!/usr/bin/env python3
"""Makes the zip file that Gradescope's page "Configure Autograder" takes.

    python3 doc/instructor/make_autograder.py turn.zip --lab turn

After the name of the zip file, type options of mark.py. The zip file contains setup.sh,
run_autograder, these options, and the students' archive of the last commit, which has no solution.
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
GIT_STATUS_LETTERS = 'XY '              # git status prints two letters and a blank before a name
EXECUTABLE_FILE = 0o100755 << 16        # as a zip file stores the mode of an executable file


def make(path, options):
    """Write the zip file. If an option is invalid, end the program with the message of mark.py."""
    if parse(['.', '-o', '.', *options]).points:
        sys.exit('the points come from launch/checks/points.yaml: edit and commit that file')
    files = ['--', *(HERE / 'students.txt').read_text(encoding='utf-8').split()]
    path.write_bytes(subprocess.check_output(
        ['git', 'archive', '--format=zip', '--prefix=tb3_labs/', 'HEAD', *files], cwd=str(ROOT)))
    changed = subprocess.check_output(
        ['git', 'status', '--porcelain', '-uno', *files], cwd=str(ROOT), universal_newlines=True)
    if changed:
        names = ', '.join(line[len(GIT_STATUS_LETTERS):] for line in changed.splitlines())
        print(f'make_autograder.py: the zip file lacks these changes: {names}; commit them, and '
              'make it again', file=sys.stderr)
    texts = {file.name: file.read_text(encoding='utf-8')
             for file in (HERE / 'gradescope').iterdir()}
    texts['options'] = '\n'.join(options) + '\n'
    with zipfile.ZipFile(str(path), 'a') as archive:
        for name, text in texts.items():
            info = zipfile.ZipInfo(name)
            info.external_attr = EXECUTABLE_FILE
            archive.writestr(info, text)


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    make(pathlib.Path(sys.argv[1]), sys.argv[2:])
