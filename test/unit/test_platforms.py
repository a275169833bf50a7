"""Gradescope's zip file and results.json, and the workflow of GitHub Classroom, without a robot."""
import base64
import json
import os
import re
import runpy
import subprocess
import sys
import zipfile
from types import SimpleNamespace

import pytest
import yaml

from sandboxes import skip_if_closed
from students_archive import EXCLUDE, LIST, MISSING, ROOT
from test_marking import Strict, turned
from test_term import folder_of, mark, write
from tb3_labs.marking.intake.sandbox import UNUSED_USER_IDS, OtherUser, protection_problem
from tb3_labs.marking.limits import MAX_FILE_BYTES, MAX_THREADS_AND_PROCESSES
from tb3_labs.marking.student_nodes import LAB_NODES

MAKE = ROOT / 'doc' / 'instructor' / 'make_autograder.py'
RUN = ROOT / 'doc' / 'instructor' / 'gradescope' / 'run_autograder'
FLOW = yaml.safe_load((ROOT / 'doc' / 'instructor' / 'classroom.yml').read_text(encoding='utf-8'))
JOB, = FLOW['jobs'].values()
#: The fields of results.json and of its tests, with their types or valid values. Source:
#: https://gradescope-autograders.readthedocs.io/en/latest/specs/
NUMBER, STATUS = (int, float), ('passed', 'failed')
FORMAT, SEEN = ('text', 'html'), ('hidden', 'after_due_date', 'after_published', 'visible')
FILE = {'score': NUMBER, 'execution_time': NUMBER, 'output': str, 'output_format': FORMAT, 'visibility': SEEN,
        'stdout_visibility': SEEN, 'extra_data': dict, 'tests': list}
TEST = {'score': NUMBER, 'max_score': NUMBER, 'status': STATUS, 'name': str, 'number': str, 'output': str,
        'visibility': SEEN}


def checked(text):
    """Returns the content of a results.json. It must have the fields that Gradescope knows."""
    found = json.loads(text)
    for fields, given in [(FILE, found)] + [(TEST, test) for test in found['tests']]:
        for name, value in given.items():
            valid = fields[name]
            assert value in valid if valid in (STATUS, FORMAT, SEEN) else isinstance(value, valid), (name, value)
    assert isinstance(found['score'], NUMBER)       # Gradescope requires it if there are no tests
    return found


@pytest.mark.parametrize('handed, seen, score, words', [
    ({}, turned(90.0), None, ['what the node printed last', 'node: lab2/node.py.']),
    ({}, turned(70.0), None, ['short of the goal, where 10 are allowed; see doc/imu_lab.md']),
    ({'unjudged': 'It lacks cv2.'}, None, 0.0, ['not judged.', 'it lacks cv2.']),
    ({'unjudged': '<script>alert(1)</script>'}, None, 0.0, ['<script>alert(1)</script>', 'a "remark", <b>.'])])
def test_each_submission_has_results_with_the_sentences_of_its_page(tmp_path, handed, seen, score, words):
    folder = folder_of(tmp_path)
    marks = write(folder, 'submission', seen, **handed)
    found = checked((tmp_path / 'gradescope' / 'submission' / 'results.json').read_text())
    said = Strict('<html><body>{}</body></html>'.format(found['output']))
    text = ' '.join([said.words, *(test['output'] for test in found['tests'])]).lower()
    assert [word for word in words if word not in text] == []
    assert found['output_format'] == 'html' and '<script' not in found['output'] and '#t=' not in found['output']
    assert found['score'] == (marks.points if score is None else score)
    assert bool(found['tests']) is marks.has_known_points


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_the_zip_file_has_what_gradescope_starts_and_no_solution(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'path', sys.path[:])
    runpy.run_path(str(MAKE))['make'](tmp_path / 'a.zip', ['--lab', 'gamepad', '--pad', 'xbox'])
    with zipfile.ZipFile(str(tmp_path / 'a.zip')) as file:
        modes = {info.filename: info.external_attr >> 16 for info in file.infolist()}
        assert file.read('options').decode().split('\n') == ['--lab', 'gamepad', '--pad', 'xbox', '']
        assert file.read('run_autograder') == RUN.read_bytes()
    assert all(modes[name] & 0o111 for name in ('setup.sh', 'run_autograder', 'tb3_labs/scripts/mark.py'))
    left_out = ['tb3_labs/' + line[len(EXCLUDE):] for line in LIST.read_text().split()[1:]]
    assert [name for name in modes if name.rstrip('/') in left_out or name.startswith(tuple(
        path + '/' for path in left_out))] == []


@pytest.mark.parametrize('options', ['--lab trun', '--lab turn --prats x', '', '--lab turn --points my.yaml'])
def test_an_option_that_is_wrong_makes_no_zip_file(tmp_path, monkeypatch, capsys, options):
    monkeypatch.setattr(sys, 'path', sys.path[:])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(MAKE))['make'](tmp_path / 'a.zip', options.split())
    words = ended.value.code if isinstance(ended.value.code, str) else capsys.readouterr().err
    assert words and ended.value.code and not list(tmp_path.iterdir())


@pytest.mark.parametrize('changed', ['', ' M launch/checks/points.yaml\n'])
def test_what_is_not_committed_is_named_because_the_zip_file_lacks_it(tmp_path, monkeypatch, capsys, changed):
    monkeypatch.setattr(sys, 'path', [str(MAKE.parent), *sys.path])
    empty_zip = b'PK\5\6' + bytes(18)
    monkeypatch.setattr(subprocess, 'check_output',
                        lambda words, **_: empty_zip if 'archive' in words else changed)
    runpy.run_path(str(MAKE))['make'](tmp_path / 'a.zip', ['--lab', 'turn'])
    warning = capsys.readouterr().err
    assert ('lacks these changes: launch/checks/points.yaml; commit' in warning) is bool(warning) is bool(changed)


def stubbed(folder, rosrun):
    """Returns the environment of a machine on which setup.sh does nothing, and `rosrun` is a shell script."""
    for path, text in (('tb3_labs/scripts/setup.sh', ':\n'), ('bin/rosrun', '#!/bin/sh\n' + rosrun)):
        (folder / path).parent.mkdir(parents=True)
        (folder / path).write_text(text)
        (folder / path).chmod(0o755)
    return dict(os.environ, PATH='{}:{}'.format(folder / 'bin', os.environ['PATH']), TMPDIR=str(folder))


@pytest.mark.parametrize('rosrun, score', [
    ('echo "$*" >"$TMPDIR/words"; for o; do case $last in -o) m=$o;; esac; last=$o; done; '
     'm=$m/gradescope/submission; mkdir -p "$m"; echo \'{"score": 7, "tests": []}\' >"$m/results.json"', 7),
    ('exit 2', 0), ('sleep 60', 0), ('kill -KILL $PPID', 0)])
def test_every_failure_gives_a_results_file(tmp_path, rosrun, score):
    """The marking may fail, or never end. A results.json that a submission wrote does not count."""
    place = tmp_path / 'autograder'
    for name in ('submission', 'results'):
        (place / name).mkdir(parents=True)
        (place / name / 'results.json').write_text('{"score": 1000, "tests": []}')
    environment = stubbed(place / 'source', rosrun)
    (place / 'source' / 'options').write_text('--lab\nturn\n')
    text = RUN.read_text().replace('/autograder', str(place)).replace(' 540 ', ' 1 ')
    subprocess.run(['bash', '-c', text], env=environment, timeout=100.0)
    found = checked((place / 'results' / 'results.json').read_text())
    assert found['score'] == score and bool(found.get('output')) is not bool(score)
    if score:
        words = (place / 'source' / 'words').read_text().split()
        assert words[:5] == ['tb3_labs', 'mark.py', str(place), '--only', 'submission']
        assert words[-2:] == ['--lab', 'turn'] and '--unprotected' in words


def open_pytests_folders(tmp_path):
    for folder in [tmp_path, *tmp_path.parents][:3]:
        folder.chmod(0o711)
    skip_if_closed(tmp_path)


@pytest.mark.skipif(os.geteuid() != 0, reason='root alone can become another user')
def test_a_program_of_root_is_another_user_without_a_sandbox(tmp_path):
    """The program can use its own folder, and no other folder or process."""
    open_pytests_folders(tmp_path)
    (tmp_path / 'ws').mkdir()
    (tmp_path / 'marks').write_text('7')
    (tmp_path / 'marks').chmod(0o600)
    user = OtherUser()
    user.hand_over(tmp_path / 'ws')
    said = subprocess.check_output(user.check_command(user.program_command([
        'sh', '-c', 'id -u; id -G; ulimit -f; ulimit -u 2>/dev/null || ulimit -p; touch ~/own && echo own; '
        'kill -0 $0 || echo kept; cat "$1" || echo hidden; touch "$1" || echo written not',
        str(os.getpid()), str(tmp_path / 'marks')])),
        env=user.program_environment(dict(os.environ, TMPDIR=str(tmp_path))),
        stderr=subprocess.DEVNULL, universal_newlines=True).split('\n')
    assert int(said[0]) in UNUSED_USER_IDS
    assert said[:4] == [said[0], said[0], str(MAX_FILE_BYTES // 512), str(MAX_THREADS_AND_PROCESSES)]
    assert said[4:] == ['own', 'kept', 'hidden', 'written not', '']


@pytest.mark.skipif(os.geteuid() != 0, reason='root alone can become another user')
def test_a_package_that_the_other_user_cannot_read_is_no_reason_for_no_points(tmp_path, monkeypatch):
    open_pytests_folders(tmp_path)
    (tmp_path / 'lib').mkdir()
    first, *others = [path for path in os.environ['PYTHONPATH'].split(':') if os.path.isdir(path + '/tb3_labs')]
    (tmp_path / 'lib' / 'tb3_labs').symlink_to(first + '/tb3_labs')
    monkeypatch.setenv('PYTHONPATH', ':'.join([str(tmp_path / 'lib')] + [
        path for path in os.environ['PYTHONPATH'].split(':') if path not in (first, *others)]))
    assert protection_problem(OtherUser()) == ''
    (tmp_path / 'lib').chmod(0o700)
    assert re.match('another user cannot run them [(].*tb3_labs', protection_problem(OtherUser()))


@pytest.mark.parametrize('unprotected, problem, said', [
    (False, '', ''), (True, '', ''), (True, 'bwrap fails', 'bwrap fails: the marking goes on without sandboxes.'),
    (False, 'bwrap fails', None)])
def test_only_a_person_switches_the_sandbox_off(
        tmp_path, monkeypatch, capsys, unprotected, problem, said):
    given = SimpleNamespace(unprotected=unprotected)
    monkeypatch.setattr(mark, 'protection_problem', lambda tried: problem if tried.is_sandbox else '')
    if said is None:
        with pytest.raises(ValueError, match='nothing was started, .*bwrap fails.*--unprotected'):
            mark._choose_protection(given, tmp_path)
    else:
        assert mark._choose_protection(given, tmp_path) is (said == '')
        assert capsys.readouterr().out.startswith(said)


def marked(folder, labs, made, *nodes):
    """Run the step that marks, as GitHub does. `made` maps a lab to its results.json. `nodes` are the files of the
    repository. Returns (status, output, result)."""
    step, = [step for step in JOB['steps'] if step.get('id') == 'marks']
    for node in nodes:
        (folder / 'submission' / node).parent.mkdir(parents=True, exist_ok=True)
        (folder / 'submission' / node).touch()
    for lab, found in made.items():
        place = folder / 'made' / lab / 'gradescope' / 'submission'
        place.mkdir(parents=True)
        (place / 'results.json').write_text(json.dumps(found))
    environment = stubbed(folder, 'mkdir -p marks; cp -r "made/$7" marks/; exit 1')    # some lab lacks a node
    done = subprocess.run(
        ['bash', '-e', '-c', step['run']], cwd=str(folder), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        universal_newlines=True, env=dict(environment, LABS=labs, RUNNER_TEMP=str(folder), GITHUB_WORKSPACE=str(folder),
                                          GITHUB_OUTPUT=str(folder / 'output')))
    output = folder / 'output'
    name, _, value = output.read_text().rstrip().partition('=') if output.exists() else ('result', '', '')
    assert name == 'result'
    return done.returncode, done.stdout, value and json.loads(base64.b64decode(value).decode())


def case(name, score, worth):
    return {'name': name, 'score': score, 'max_score': worth, 'status': 'passed' if score else 'failed', 'output': 'so'}


def test_the_workflow_sums_the_points_and_names_labs_that_were_not_judged(tmp_path):
    """The workflow adds the scores of the tests, as Classroom's reporter does."""
    status, said, result = marked(tmp_path, 'imu turn move2goal gamepad', {
        'imu': {'tests': [case('a', 2.5, 2.5), case('beyond', 0, 0)], 'output': ''},
        'turn': {'tests': [case('b', 0, 4)], 'output': ''},
        'gamepad': {'tests': [], 'output': '<p>It lacks\n<b>cv2</b> &amp; more.</p>'}},
        'course/ice6/src/imu_sub.py', 'lab2/turtlebot_controller.py', 'lab7/src/gamepad.py', 'lab7/src/lib/other.py')
    assert (status, result['max_score'], result['status']) == (0, 6.5, 'fail')
    assert [(test['name'], test['score'], test['status']) for test in result['tests']] == [
        ('imu: a', 2.5, 'pass'), ('turn: b', 0, 'fail')]
    assert 'failed  0 of 4  b  so\n' in said and '::warning::gamepad: It lacks cv2 & more.\n' in said
    assert '::notice::move2goal: There is no move2goal_tf.py or move2goal.py in a package lab7_tf, ' in said


def test_a_workflow_that_finds_nothing_fails_with_a_line(tmp_path):
    made = {'imu': {'tests': [], 'output': 'No node.'}}
    status, said, result = marked(tmp_path, 'imu turn', made, 'ice6/imu_sub.py', 'lab2/turtlebot_controller.py')
    assert status == 1 and result == ''
    assert said.endswith('::error::no node of these labs was found: imu turn\n')
    assert '::warning::turn: Not marked.' in said


def test_a_repository_may_be_one_package_with_another_name_of_its_folder(tmp_path):
    (tmp_path / 'submission').mkdir()
    (tmp_path / 'submission' / 'package.xml').write_text('<package><name>lab2</name></package>')
    made = {'turn': {'tests': [case('a', 4, 4)], 'output': ''}}
    status, said, result = marked(tmp_path, 'imu turn', made, 'src/turtlebot_controller.py')
    assert (status, result['max_score']) == (0, 4) and '::notice::imu: There is no imu_sub.py' in said


def test_the_workflow_knows_all_labs_and_the_reporter_its_step():
    packages = {package for lab in LAB_NODES.values() for package in lab.packages}
    assert set(FLOW['on']['push']['paths']) == {'**/{}/**'.format(name) for name in packages} | {
        '*.py', 'src/*.py', 'scripts/*.py'}
    assert set(FLOW['env']['LABS'].split()) == set(LAB_NODES)
    reporter = JOB['steps'][-1]
    runner, = reporter['with'].values()
    assert reporter['env'] == {runner.upper() + '_RESULTS': '${{ steps.%s.outputs.result }}' % runner}
    assert list(FLOW['jobs']) == ['run-autograding-tests']
