"""After `source scripts/setup.sh` a person's bash has roscd. The set-up ends with the line to type."""
import os
import pathlib
import pty
import subprocess

import pytest
from pages import ROOT, SCRIPTS, needs_setup

SETUP = SCRIPTS / 'setup.sh'
pytestmark = needs_setup


def test_roscd_leads_to_the_package(tmp_path):
    done = subprocess.run(['bash', '--norc', '-i', '-c', 'source {}; roscd tb3_labs && pwd -P'.format(SETUP)],
                          timeout=600.0, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True,
                          env={'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path)}, check=True)
    assert (pathlib.Path(done.stdout.splitlines()[-1]) / 'package.xml').samefile(ROOT / 'package.xml')


@pytest.mark.parametrize('command, line', [
    ('bash {0}', 'tb3_labs: all is set up. In each terminal, type: source {0}'),
    ('source {0}', '')])    # bash -c is not interactive; a person's terminal prints that it is ready
def test_the_set_up_ends_with_the_line_to_type(tmp_path, command, line):
    ours, theirs = pty.openpty()
    try:
        subprocess.run(['bash', '-c', command.format(SETUP)], timeout=600.0, stdin=theirs, stdout=theirs,
                       env={'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path)}, check=True)
        os.write(theirs, b'.')
        assert os.read(ours, 4096).decode().split('\r\n')[0].strip('.') == line.format(SETUP)
    finally:
        os.close(ours)
        os.close(theirs)
