"""After `source scripts/setup.sh` a person's bash has roscd, and completes words by the Tab key."""
import os
import pathlib
import pty
import subprocess

import pytest
from pages import ROOT, SCRIPTS

SETUP = SCRIPTS / 'setup.sh'
#: The Tab key does this: it sets the words of the line, and calls the function that `complete -p` names.
TAB = '''
tab() {
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMP_LINE="$*" COMPREPLY=()
  $(complete -p "$1" | sed 's/.*-F \\([^ ]*\\).*/\\1/')
  echo "$1: ${COMPREPLY[*]}"
}
'''


@pytest.fixture(scope='module')
def printed(tmp_path_factory):
    if not (ROOT / 'build' / '.ws' / 'build.stamp').exists():
        pytest.skip('scripts/setup.sh has not set this repository up')
    home = tmp_path_factory.mktemp('home')
    # Noetic's hook sources rosbash each time. On Debian the second command does.
    script = 'source {0}; for file in {1}; do [ ! -r $file ] || source $file; done; source {0}\n{2}\n'.format(
        SETUP, '/usr/share/bash-completion/completions/rosbash /etc/bash_completion.d/rosbash', TAB) + '''
tab rosrun tb3_l; tab rosrun tb3_labs sk; tab rosrun tb3_labs unknown
tab roslaunch tb3_labs fake; tab rostest tb3_labs check_; tab roscd tb3_la
roscd tb3_labs && pwd -P | sed 's/^/at: /'
'''
    done = subprocess.run(['bash', '--norc', '-i', '-c', script], timeout=600.0, stdin=subprocess.DEVNULL,
                          env={'PATH': '/usr/bin:/bin', 'HOME': str(home)}, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, universal_newlines=True)
    assert 'command not found' not in done.stderr, done.stderr
    return done.stdout.splitlines()


def test_programs_launch_files_and_tests_are_completed_and_roscd_leads_to_the_package(printed):
    tests = sorted(path.name for path in (ROOT / 'launch' / 'checks').glob('check_*.test'))
    assert printed[:5] == ['rosrun: tb3_labs', 'rosrun: skeleton.py', 'rosrun: ',
                           'roslaunch: fake_robot.launch', 'rostest: ' + ' '.join(tests)]
    assert printed[5].startswith('roscd: tb3_labs')
    assert (pathlib.Path(printed[6].split(': ')[1]) / 'package.xml').samefile(ROOT / 'package.xml')


@pytest.mark.parametrize('command, line', [
    ('bash {0}', 'tb3_labs: all is set up. In each terminal, type: source {0}'),
    ('source {0}', '')])    # bash -c is not interactive; a person's terminal prints that it is ready
def test_the_set_up_ends_with_the_line_to_type(printed, tmp_path, command, line):
    ours, theirs = pty.openpty()
    try:
        subprocess.run(['bash', '-c', command.format(SETUP)], timeout=600.0, stdin=theirs, stdout=theirs,
                       env={'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path)}, check=True)
        os.write(theirs, b'.')
        assert os.read(ours, 4096).decode().split('\r\n')[0].strip('.') == line.format(SETUP)
    finally:
        os.close(ours)
        os.close(theirs)
