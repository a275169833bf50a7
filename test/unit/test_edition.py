"""The students' edition: nothing of the solutions is in it, and nothing in it is missing."""
import ast
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import pytest
import yaml

import tb3_labs.msg
import tb3_labs.srv
from tb3_labs.handout.edition import chain, left_out, made, problems, rules_of
from tb3_labs.handout.passages import for_students, without_links
from tb3_labs.handout.references import Files, references

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Tests of facts about the whole tree: they hold in the edition as well.
WHOLE_TREE = ['test_house', 'test_metadata', 'test_python38', 'test_readme', 'test_sheets']
SOLUTIONS = ['scripts/imu_sub.py', 'scripts/turtlebot_controller.py', 'scripts/move2goal_tf.py',
             'scripts/gamepad.py']
#: Long lines of the solutions that stand in any program.
IDIOMS = {'rospy.on_shutdown(self._close)', 'self._lock = threading.Lock()',
          'self._changed.notify_all()', 'except ValueError as problem:',
          'except rospy.ROSException:'}
#: What fills the handouts' TODOs, as in test/ros/student_nodes; spaces do not count.
ANSWERS = {
    'imu_sub.py': [
        "rospy.Subscriber('imu', Imu, self.callback_imu)", 'q = Quaternion(imu.orientation.w,',
        'euler = q.to_euler(degrees=True)'],
    'turtlebot_controller.py': [
        'yaw = q.to_euler(degrees=True)[2]', 'self.curr_yaw = self.convert_yaw(yaw)',
        'self.goal_yaw = self.curr_yaw + 90', 'self.goal_yaw = self.curr_yaw - 90',
        'yaw_err = self.goal_yaw - self.curr_yaw', 'ang_z = K_HDG * yaw_err',
        'elif ang_z < -MAX_ANG_Z:', 'elif -MIN_ANG_Z < ang_z < 0:'],
    'move2goal_tf.py': [
        "rospy.Service('/set_pose', SetInitialPose, self.set_pose_callback)",
        'self.normalize_angle(global_yaw - self.initial_global_yaw)',
        'dx = global_x - self.initial_global_x', 'self.local_x = cos * dx + sin * dy',
        'self.local_y = -sin * dx + cos * dy', 'dx = self.goal_x - self.local_x',
        'self.normalize_angle(math.atan2(dy, dx) - self.local_yaw)',
        'self.normalize_angle(self.goal_yaw - self.local_yaw)',
        'cmd.angular.z = 0.3 * yaw_error', 'cmd.angular.z = 0.5 * yaw_error'],
    'gamepad.py': [
        "rospy.ServiceProxy('/set_pose', SetInitialPose)", 'pose.pose.pose.position.x = x',
        'pose.pose.pose.orientation.z = math.sin(yaw / 2.0)', 'pose.pose.covariance = [0.1] * 36']}


def load_script():
    spec = importlib.util.spec_from_file_location(
        'edition_script', str(ROOT / 'scripts' / 'edition.py'))
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


SCRIPT = load_script()


def closed(code):
    """Code without its spaces."""
    return re.sub(r'\s+', '', code)


@pytest.fixture(scope='module')
def texts():
    return {path: SCRIPT.text_of(ROOT / path) for path in sorted(SCRIPT.paths_of(ROOT))}


@pytest.fixture(scope='module')
def gone(texts):
    return left_out(texts, rules_of('student', yaml.safe_load(texts['doc/edition.yaml'])))


@pytest.fixture(scope='module')
def edition(texts, gone):
    return made(texts, gone)


@pytest.fixture(scope='module')
def folder(texts, edition, tmp_path_factory):
    place = tmp_path_factory.mktemp('edition') / 'tb3_labs'
    SCRIPT.write(ROOT, place, texts, edition)
    return place


def programs(edition):
    return {path: text for path, text in edition.items()
            if path.endswith('.py') and not path.startswith('doc/')}


# ----- the students' edition of this package

def test_the_solutions_are_left_out_and_what_students_need_is_there(gone, edition):
    assert set(SOLUTIONS) <= set(gone)
    assert {gone[path] for path in SOLUTIONS} == {'a solution of a lab'}
    assert {'launch/turn.launch', 'launch/move2goal.launch', 'launch/gamepad.launch',
            'launch/imu_sub.launch', 'launch/demo.launch', 'scripts/mark.py',
            'test/ros/turn_test.py', 'test/unit/test_controller.py', 'doc/marking.md',
            'scripts/edition.py'} <= set(gone)
    assert {'launch/fake_robot.launch', 'test/marking/check_turn.test', 'scripts/lab_report.py',
            'scripts/checkoff.py', 'scripts/setup.sh', 'scripts/test.sh', 'msg/MouseController.msg',
            'srv/ResetPose.srv', 'doc/imu_lab.md', 'CMakeLists.txt', 'LICENSE', '.gitignore',
            'src/tb3_labs/geometry/se2.py', 'test/ros/fake_robot_test.py'} <= set(edition)
    assert any(path.startswith('test/unit/recordings/') for path in edition)


def test_no_solution_stands_in_another_file(texts, gone, edition):
    lines = set()
    for path in gone:
        if gone[path] == 'a solution of a lab' and path.endswith('.py'):
            bodies = [node for node in ast.walk(ast.parse(texts[path]))
                      if isinstance(node, ast.FunctionDef)]
            lines |= {line.strip() for body in bodies
                      for line in texts[path].split('\n')[body.lineno:body.end_lineno]}
    lines = {line for line in lines if len(line) > 25 and not line.startswith(('def ', '#', '"'))}
    assert len(lines) > 150
    found = {(path, line) for path, text in programs(edition).items()
             for line in map(str.strip, text.split('\n')) if line in lines - IDIOMS}
    assert found == set()


@pytest.mark.parametrize('name', ANSWERS)
def test_no_todo_is_filled_in_any_file(name, texts, edition):
    node = closed(texts['test/ros/student_nodes/' + name])
    for answer in map(closed, ANSWERS[name]):
        assert answer in node        # else this test looks for nothing
        assert [path for path, text in edition.items() if answer in closed(text)] == []


def test_nothing_in_it_names_what_is_missing(edition, gone):
    assert problems(edition, gone) == []


def test_every_import_leads_to_a_file_of_it(edition, folder):
    count = 0
    for path, text in programs(edition).items():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and (node.module or '').startswith('tb3_labs.'):
                place = folder / 'src' / node.module.replace('.', '/')
                parts = [place / alias.name for alias in node.names]
                count += 1
                assert node.module in ('tb3_labs.msg', 'tb3_labs.srv') or (
                    place.with_suffix('.py').exists() or all(
                        part.with_suffix('.py').exists() or part.is_dir() for part in parts)), path
    assert count > 300


def test_every_program_of_it_compiles(edition):
    for path, text in programs(edition).items():
        compile(text, path, 'exec', dont_inherit=True)


def test_a_launch_file_of_it_starts_nothing_that_is_missing(edition):
    for path, text in edition.items():
        if path.endswith(('.launch', '.test')):
            for name in re.findall(r'pkg="tb3_labs"\s+type="([^"]+)"', text):
                assert any(place + name in edition for place in (
                    'scripts/', 'test/')), (path, name)


def test_no_module_of_it_serves_only_what_is_left_out(edition):
    """What nothing in the edition uses belongs to a solution, and is named in doc/edition.yaml."""
    files = Files(edition)
    waiting = [path for path in edition if path.startswith((
        'scripts/', 'launch/', 'test/marking/', 'test/ros/', 'doc/skeletons/'))]
    used = set()
    while waiting:
        path = waiting.pop()
        if path not in used:
            used.add(path)
            waiting += [found.target for found in references(path, edition[path], files)]
    general = ('src/tb3_labs/news.py', 'src/tb3_labs/ros/dynparam.py',
               'src/tb3_labs/panel/page/')    # its server offers the whole folder
    assert [path for path in edition if path.startswith('src/') and path not in used
            and not path.endswith('__init__.py') and not path.startswith(general)] == []


def test_its_unit_tests_are_collected_and_those_of_the_whole_tree_pass(folder):
    package = folder / 'src' / 'tb3_labs'
    for generated in (tb3_labs.msg, tb3_labs.srv):
        source = pathlib.Path(generated.__file__).parent
        os.symlink(str(source), str(package / source.name))
    result = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
         '-k', ' or '.join(WHOLE_TREE), 'test/unit'], cwd=str(folder), timeout=120.0,
        env=dict(os.environ, PYTHONPATH=os.pathsep.join(
            [str(folder / 'src')] + os.environ.get('PYTHONPATH', '').split(os.pathsep)),
            PYTHONDONTWRITEBYTECODE='1'),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert result.returncode == 0, result.stdout[-3000:]
    assert int(re.search(r'(\d+) deselected', result.stdout).group(1)) > 500


def test_permissions_and_files_that_are_no_text_are_copied(folder):
    assert os.access(str(folder / 'scripts' / 'setup.sh'), os.X_OK)
    assert not os.access(str(folder / 'package.xml'), os.X_OK)
    picture = pathlib.Path('doc') / 'report.png'
    assert (folder / picture).read_bytes() == (ROOT / picture).read_bytes()


# ----- what follows from a file that is left out

SMALL = {
    'scripts/solution.py': 'from tb3_labs.control.law import act\n',
    'scripts/robot.py': 'from tb3_labs.geometry import angles\n',
    'src/tb3_labs/control/law.py': '', 'src/tb3_labs/geometry/angles.py': '',
    'src/tb3_labs/report/page.py': 'def write():\n    from tb3_labs.control import law\n',
    'launch/solution.launch': '<node pkg="tb3_labs"\n type="solution.py" name="x"/>\n'
                              '<rosparam file="$(find tb3_labs)/launch/params/x.yaml"/>',
    'launch/both.launch': '<include file="$(find tb3_labs)/launch/solution.launch"/>',
    'launch/robot.launch': '<!-- <node pkg="tb3_labs" type="solution.py"/> -->\n'
                           '<node pkg="tb3_labs" type="robot.py" name="r"/>\n'
                           '<node pkg="lab2" type="solution.py" name="s"/>',
    'launch/params/x.yaml': '', 'launch/params/pad_y.yaml': '',
    'test/ros/a.test': '<test pkg="tb3_labs" type="a_test.py" test-name="a"/>',
    'test/ros/a_test.py': 'run(["roslaunch", "tb3_labs", "both.launch"])',
    'test/ros/b.test': '<include file="$(find tb3_labs)/launch/both.launch"/>\n'
                       '<test pkg="tb3_labs" type="b_test.py" test-name="b"/>',
    'test/ros/b_test.py': '"""As a_test.py."""\nimport case',
    'test/ros/c.test': '<test pkg="tb3_labs" type="c_test.py" test-name="c"/>',
    'test/ros/c_test.py': '"""As solution.py."""\nimport case', 'test/ros/case.py': '',
    'test/unit/test_law.py': 'from tb3_labs.control.law import act', 'test/unit/helper.py': '',
    'test/unit/test_helped.py': 'import helper\nimport tb3_labs.report.page',
    'test/unit/test_read.py': 'PATH = ROOT / "scripts" / "solution.py"',
    'test/unit/test_folder.py': 'NODES = ROOT / "nodes_of_ann"', 'test/ros/nodes_of_ann/n.py': '',
    'test/unit/test_own.py': '"solution.py"\nFILES = ["lab2/scripts/solution.py", "control"]',
    'doc/a.md': '[b](b.md#x) `x` [c](c.md)\n', 'doc/b.md': '![p](p.png)\n', 'doc/p.png': '',
    'doc/c.md': '\n# C\n', 'doc/d.md': '<!-- instructors -->\n', 'LICENSE': ''}


def small_rules(*stays, solution=('scripts/solution.py', 'src/tb3_labs/control/**', 'doc/b.md',
                                  'doc/d.md', 'test/ros/nodes_of_ann/*')):
    return rules_of('student', {'student': {
        'left_out': {'a solution': list(solution)}, 'stays': list(stays)}})


def test_what_needs_a_file_that_is_left_out_follows():
    gone = left_out(SMALL, small_rules())
    assert gone == {
        'scripts/solution.py': 'a solution', 'src/tb3_labs/control/law.py': 'a solution',
        'doc/b.md': 'a solution', 'doc/d.md': 'a solution', 'doc/p.png': 'only doc/b.md uses it',
        'src/tb3_labs/report/page.py': 'imports src/tb3_labs/control/law.py',
        'test/unit/test_law.py': 'imports src/tb3_labs/control/law.py',
        'test/unit/test_helped.py': 'imports src/tb3_labs/report/page.py',
        'test/unit/helper.py': 'only test/unit/test_helped.py uses it',
        'test/ros/nodes_of_ann/n.py': 'a solution',
        'test/unit/test_folder.py': 'reads test/ros/nodes_of_ann/',
        'test/unit/test_read.py': 'reads scripts/solution.py',
        'launch/solution.launch': 'starts scripts/solution.py',
        'launch/params/x.yaml': 'only launch/solution.launch uses it',
        'launch/both.launch': 'includes launch/solution.launch',
        'test/ros/a_test.py': 'starts launch/both.launch',
        'test/ros/a.test': 'starts test/ros/a_test.py',
        'test/ros/b.test': 'includes launch/both.launch',
        'test/ros/b_test.py': 'only test/ros/b.test uses it'}
    assert made(SMALL, gone)['doc/a.md'] == 'b `x` [c](c.md)\n'
    assert problems(made(SMALL, gone), gone) == []


def test_a_file_that_stays_is_no_solution_in_spite_of_its_folder():
    gone = left_out(SMALL, small_rules('src/tb3_labs/control/law.py', 'launch/params/x.yaml'))
    assert not {'src/tb3_labs/control/law.py', 'src/tb3_labs/report/page.py',
                'launch/params/x.yaml', 'test/unit/helper.py'} & set(gone)


def test_a_file_that_must_stay_and_cannot_is_told_with_the_reason():
    with pytest.raises(ValueError) as problem:
        left_out(SMALL, small_rules('test/ros/a.test'))
    assert str(problem.value) == (
        'test/ros/a.test cannot stay: starts test/ros/a_test.py, which starts launch/both.launch, '
        'which includes launch/solution.launch, which starts scripts/solution.py (a solution)')
    assert chain('LICENSE', {}) == ''


@pytest.mark.parametrize('settings, words', [
    (None, 'no edition'), ({}, 'no edition'), ({'teacher': {}}, 'teacher'),
    ({'student': {'left_out': {}}}, 'left_out and stays'),
    ({'student': {'left_out': ['a'], 'stays': []}}, 'with its reason'),
    ({'student': {'left_out': {'why': 'a'}, 'stays': []}}, 'lists of paths'),
    ({'student': {'left_out': {'why': [1]}, 'stays': []}}, 'lists of paths')])
def test_rules_that_are_none_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        rules_of('student', settings)


@pytest.mark.parametrize('rules', [
    small_rules(solution=['scripts/solutoin.py']), small_rules('scripts/robbot.py'),
    small_rules(solution=['src/tb3_labs/*.py'])])    # * does not span folders
def test_a_line_without_a_file_is_refused(rules):
    with pytest.raises(ValueError, match='no file is called'):
        left_out(SMALL, rules)


@pytest.mark.parametrize('path, text, words', [
    ('scripts/x.py', 'import os\nfrom tb3_labs.control.law import a', 'scripts/x.py:2: imports'),
    ('src/x.py', 'from tb3_labs.control import law', 'src/x.py:1: imports'),
    ('launch/x.launch', '\n<include file="$(find tb3_labs)/launch/none.launch"/>', 'x.launch:2: '),
    ('doc/x.md', 'Type\n`rosrun tb3_labs solution.py 1`\n', 'solution.py, which is not in'),
    ('doc/x.md', 'roslaunch tb3_labs both.launch', 'both.launch, which is not in'),
    ('doc/x.md', 'see `scripts/solution.py`', 'scripts/solution.py, which is not in'),
    ('doc/x.md', 'see `control/law.py`', 'control/law.py, which is not in'),
    ('doc/x.md', '[e](e.md)', 'e.md, which is not in'), ('doc/x.md', '[c](c.md#d)', 'c.md#d'),
    ('doc/x.md', '[here](#nowhere)', '#nowhere')])
def test_what_names_a_missing_file_is_noticed(path, text, words):
    gone = left_out(SMALL, small_rules())
    found, = problems(dict(made(SMALL, gone), **{path: text}), gone)
    assert found.startswith(path + ':') and words in found


def test_names_of_students_own_files_are_no_problem():
    gone = left_out(SMALL, small_rules())
    page = ('`solution.py` in lab2/scripts/solution.py, `rosrun lab2 solution.py`, [c](c.md#c)\n'
            '# Own\n[o](#own)')
    assert problems(dict(made(SMALL, gone), **{'doc/x.md': page}), gone) == []


def test_a_program_that_is_none_is_named():
    with pytest.raises(ValueError, match=r'scripts/x\.py:2: '):
        left_out(dict(SMALL, **{'scripts/x.py': 'a = 1\n<<<<<<<\n'}), small_rules())


# ----- passages of pages

def test_marked_passages_go_and_leave_no_double_space():
    page = ('a\n\n<!-- instructor only -->\nb\n\nc\n<!-- end -->\n\nd\n'
            '<!-- instructor only -->\n<!-- end -->\n| x |\n| y | <!-- instructor only -->\n'
            '| z |\n')
    assert for_students('p.md', page) == 'a\n\nd\n| x |\n| z |\n'


def test_a_page_without_marks_stays_as_it_is():
    page = ('# A\n\n\n<!-- imu: made by test/make_graded.py -->\n```\n\n\n```\n<!-- ended -->\n'
            'marks: `<!-- instructor only -->`, `<!-- end -->`\n')
    assert for_students('p.md', page) == page


@pytest.mark.parametrize('page, line', [
    ('<!-- instructor only -->\na\n', 1), ('a\n<!-- end -->\n', 2),
    ('<!-- instructor only -->\n<!-- instructor only -->\n<!-- end -->\n', 2),
    ('a <!-- instructor only -->\n', 1), ('<!-- instructors only -->\n', 1),
    ('<!-- instructor -->\n', 1), ('<!--instructor only-->\n', 1),
    ('<!-- Instructor only -->\n', 1),
    ('<!-- /instructor only -->\n', 1), ('<!-- end of it -->\n', 1), ('b <!-- end -->\n', 1)])
def test_a_mark_that_is_wrong_is_refused(page, line):
    with pytest.raises(ValueError, match='p.md:{}: '.format(line)):
        for_students('p.md', page)


def test_links_to_missing_pages_become_text():
    page = ('![a picture](gone.png)\n[a\nb](gone.md#x), [c](here.md), ![d](gone.png)\n'
            '| [e](gone.md) | f |\n| [e](gone.md), [c](here.md) | f |\n```\n[e](gone.md)\n```\n')
    assert without_links('doc/p.md', page, {'doc/gone.md', 'doc/gone.png'}) == (
        'a\nb, [c](here.md), \n| e, [c](here.md) | f |\n```\n[e](gone.md)\n```\n')


# ----- the command

@pytest.fixture
def elsewhere():
    """A folder outside of the repository, in which the tests keep theirs."""
    with tempfile.TemporaryDirectory(dir='/tmp') as folder:
        yield pathlib.Path(folder)


@pytest.fixture
def said(capsys):
    """Runs the command: (its exit status, what it says)."""
    def run(*words):
        status = SCRIPT.main([str(word) for word in words])
        return status, ''.join(capsys.readouterr())
    return run


def test_a_folder_that_will_not_do_is_refused_by_one_line(said, elsewhere):
    (elsewhere / 'file').write_text('mine')
    for place, words in ((elsewhere, 'not an empty folder'), (elsewhere / 'file', 'not an empty'),
                         (ROOT, 'is inside of'), (ROOT / 'new' / 'one', 'is inside of')):
        status, text = said('student', place)
        assert status == 1 and words in text and text.count('\n') == 1
    assert (elsewhere / 'file').read_text() == 'mine' and not (ROOT / 'new').exists()


def test_another_edition_is_refused(said, elsewhere):
    status, text = said('teacher', elsewhere / 'new')
    assert (status, text) == (1, "edition.py: there is no edition 'teacher': student\n")
    assert not (elsewhere / 'new').exists()


def test_an_installed_package_is_no_source(said, tmp_path, monkeypatch):
    (tmp_path / 'package.xml').write_text('<package/>')
    monkeypatch.setattr(SCRIPT.rospkg.RosPack, 'get_path', lambda self, name: str(tmp_path))
    status, text = said('student', tmp_path / 'new')
    assert status == 1 and 'has no sources' in text and text.count('\n') == 1


@pytest.mark.parametrize('words', [['student'], ['student', 'x', '--list'], []])
def test_a_directory_or_the_list_is_asked_for(words):
    with pytest.raises(SystemExit):
        SCRIPT.main(words)


def test_without_git_the_sources_are_found(tmp_path):
    sources = ['.ci/run', '.devcontainer/Dockerfile', '.dockerignore', '.gitattributes', '.gitignore',
               'a.py', 'doc/b.md']
    for path in (*sources, 'build/x', '.pytest_cache/y',
                 'src/__pycache__/z.pyc', 'src/tb3_labs.egg-info/w', 'test/v.pyc', '.hidden'):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text('')
    assert sorted(SCRIPT.paths_of(tmp_path)) == sources


def test_what_git_does_not_track_is_no_part_of_it(tmp_path):
    (tmp_path / 'a').write_text('')
    (tmp_path / 'b').write_text('')
    subprocess.run('git init -q && git add a', shell=True, cwd=str(tmp_path), check=True)
    assert SCRIPT.paths_of(tmp_path) == ['a']
