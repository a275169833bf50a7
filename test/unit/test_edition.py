"""The students' edition: nothing of the solutions is in it, and nothing in it is missing."""
import ast
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import pytest

import tb3_labs.msg
import tb3_labs.srv
from test_refusals import main_of
from test_skeletons import answers
from tb3_labs.handout.edition import LIST, README, checked_place, kept, paths_of, write
from tb3_labs.marking.marks import LABS

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOLUTIONS = ['scripts/imu_sub.py', 'scripts/turtlebot_controller.py', 'scripts/move2goal_tf.py',
             'scripts/gamepad.py', 'scripts/demo.py', 'scripts/send_goal.py']
#: Long lines of the solutions that stand in any program.
IDIOMS = {'rospy.on_shutdown(self._close)', 'self._lock = threading.Lock()',
          'self._changed.notify_all()', 'except ValueError as problem:',
          'except rospy.ROSException:', "rospy.logwarn('%s', problem)",
          "rospy.loginfo('Pose reset successfully.')"}     # which a skeleton has, too


def text_of(path):
    """The text of a file, '' for a picture."""
    try:
        return path.read_text(encoding='utf-8')
    except UnicodeDecodeError:
        return ''


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp('edition') / 'tb3_labs'
    write(ROOT, place)
    return place


@pytest.fixture(scope='module')
def edition(folder):
    """{path: text} of its files."""
    return {path.relative_to(folder).as_posix(): text_of(path)
            for path in sorted(folder.rglob('*')) if path.is_file()}


def imports_of(text, edition):
    """The files that a program imports from this package; AssertionError for one that is missing."""
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += ['{}.{}'.format(node.module, alias.name) for alias in node.names]
    for name in names:
        if re.match(r'tb3_labs\.(?!(msg|srv)\b)', name):
            place = 'src/' + name.replace('.', '/')     # a module, or a name in a module
            found = {place + '.py', place + '/__init__.py', place.rpartition('/')[0] + '.py'} & set(edition)
            assert found, name
            yield from found


# ----- the students' edition of this package

def test_the_solutions_are_left_out_and_what_students_need_is_there(edition):
    assert not set(edition) & {*SOLUTIONS, LIST, 'scripts/mark.py', 'scripts/edition.py', 'CHANGELOG.rst'}
    assert not [path for path in edition if path.startswith(('doc/instructor/', 'test/ros/'))]
    assert {'launch/fake_robot.launch', 'test/marking/check_turn.test', 'scripts/lab_report.py',
            'scripts/checkoff.py', 'scripts/setup.sh', 'scripts/test.sh', 'msg/MouseController.msg',
            'srv/ResetPose.srv', 'doc/imu_lab.md', 'CMakeLists.txt', 'LICENSE', '.gitignore',
            'src/tb3_labs/geometry/se2.py'} <= set(edition)
    assert edition['README.md'] == (ROOT / README).read_text(encoding='utf-8')


def test_no_solution_stands_in_another_file(edition):
    lines = set()
    for path in SOLUTIONS[:4]:
        text = (ROOT / path).read_text(encoding='utf-8')
        bodies = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
        lines |= {line.strip() for body in bodies
                  for line in text.split('\n')[body.lineno:body.end_lineno]}
    lines = {line for line in lines if len(line) > 25 and not line.startswith(('def ', '#', '"'))}
    assert len(lines) > 100
    assert {(path, line) for path, text in edition.items() if path.endswith('.py')
            for line in map(str.strip, text.split('\n')) if line in lines - IDIOMS} == set()


@pytest.mark.parametrize('lab', sorted(LABS))
def test_no_todo_is_filled_in_any_file(lab, edition):
    lines = [re.sub(r'\s+', '', line) for _, piece in answers(lab) for line in piece]
    lines = [line for line in lines if len(line) > 20 and not line.startswith(('from', 'import'))]
    assert len(lines) > 2
    closed = {path: re.sub(r'\s+', '', text) for path, text in edition.items()
              if not path.startswith('doc/skeletons/')}      # test_skeletons.py looks at these
    assert [(path, line) for path, text in closed.items() for line in lines if line in text] == []


def test_every_import_leads_to_a_file_of_it_and_every_module_serves_one(edition):
    """A module that nothing in the edition uses belongs to a solution."""
    waiting = [path for path in edition if path.endswith('.py')
               and not path.startswith(('src/', 'doc/'))]
    waiting += ['src/{}.py'.format(name.replace('.', '/')) for path, text in edition.items()
                if not path.endswith('.py') for name in re.findall(r'-m (tb3_labs[\w.]+)', text)]
    used = set()
    while waiting:
        path = waiting.pop()
        if path not in used:
            used.add(path)
            waiting += imports_of(edition[path], edition)
    assert [path for path in edition if path.startswith('src/') and path.endswith('.py')
            and path not in used and not path.endswith('__init__.py')] == []


def test_a_launch_file_of_it_starts_and_includes_nothing_that_is_missing(edition):
    for path, text in edition.items():
        if path.endswith(('.launch', '.test', '.launch.in')):
            for name in re.findall(r'pkg="tb3_labs"\s+type="([^"]+)"', text):
                assert {place + name for place in ('scripts/', 'test/', 'test/marking/')} & set(
                    edition), (path, name)
            for name in re.findall(r'\$\(find tb3_labs\)/([\w./-]+\.\w+)', text):
                assert name in edition, (path, name)


def test_its_pages_name_no_file_that_is_missing(edition):
    """Its own tests look at links and commands."""
    gone = set(paths_of(ROOT)) - set(edition)
    names = gone | {path[len('src/tb3_labs/'):] for path in gone if path.startswith('src/tb3_labs/')}
    for path, text in edition.items():
        if path.endswith('.md'):
            text = re.sub('<!--.*?-->', '', text)
            assert set(re.findall(r'[\w.-]+(?:/[\w.-]+)+', text)) & names == set(), path
            assert not re.search('instructor/|edition', text), path


def test_its_own_unit_tests_pass(folder):
    package = folder / 'src' / 'tb3_labs'
    for generated in (tb3_labs.msg, tb3_labs.srv):
        source = pathlib.Path(generated.__file__).parent
        os.symlink(str(source), str(package / source.name))
    result = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', 'test/unit'],
        cwd=str(folder), timeout=120.0, env=dict(os.environ, PYTHONPATH=os.pathsep.join(
            [str(folder / 'src')] + os.environ.get('PYTHONPATH', '').split(os.pathsep)),
            PYTHONDONTWRITEBYTECODE='1'),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert result.returncode == 0, result.stdout[-3000:]
    assert int(re.search(r'(\d+) passed', result.stdout).group(1)) > 100


def test_permissions_and_pictures_are_copied(folder):
    assert os.access(str(folder / 'scripts' / 'setup.sh'), os.X_OK)
    assert not os.access(str(folder / 'package.xml'), os.X_OK)
    picture = pathlib.Path('doc') / 'report.png'
    assert (folder / picture).read_bytes() == (ROOT / picture).read_bytes()


# ----- the list, and the command

def test_a_later_line_of_the_list_holds():
    paths = ['README.md', 'a/b.py', 'a/c.py', 'a/d/e.py', 'ab.py']
    assert kept(paths, '# solutions\na/   # all of it\n\n!a/c.py\n') == ['README.md', 'a/c.py', 'ab.py']
    assert kept(paths, 'a/\n!a/d/\na/d/e.py\nab.py') == ['README.md']


@pytest.mark.parametrize('line', ['a', 'b.py', '!a/x.py', 'b/'])
def test_a_line_without_a_file_is_refused(line):
    with pytest.raises(ValueError, match='a line without a file'):
        kept(['a/b.py'], line)


def test_a_folder_that_will_not_do_is_refused():
    with tempfile.TemporaryDirectory(dir='/tmp') as folder:    # outside of the repository
        place = pathlib.Path(folder)
        assert checked_place(place, ROOT) == place.resolve()
        (place / 'file').touch()
        for wrong, words in ((place, 'not an empty folder'), (place / 'file', 'not an empty'),
                             (ROOT, 'is inside of'), (ROOT / 'new' / 'one', 'is inside of')):
            with pytest.raises(ValueError, match=words):
                checked_place(wrong, ROOT)


def test_the_command_says_what_it_wrote_or_why_not(tmp_path, monkeypatch, capsys):
    main = main_of('edition.py')
    with tempfile.TemporaryDirectory(dir='/tmp') as folder:
        assert main(['student', folder]) == 0
        assert re.fullmatch(re.escape(folder) + r': \d+ files; doc/instructor/edition.txt lists what '
                            r'is left out\n', capsys.readouterr().out)
    (tmp_path / 'package.xml').write_text('<package/>')
    monkeypatch.setattr('rospkg.RosPack.get_path', lambda self, name: str(tmp_path))
    assert main(['student', str(tmp_path / 'new')]) == 1
    said = capsys.readouterr().err
    assert 'has no sources' in said and said.count('\n') == 1


def test_the_sources_are_found_with_and_without_git(tmp_path):
    sources = ['.ci/run', '.devcontainer/Dockerfile', '.dockerignore', '.gitattributes', '.gitignore',
               'a.py', 'doc/b.md']
    for path in (*sources, 'build/x', '.pytest_cache/y',
                 'src/__pycache__/z.pyc', 'src/tb3_labs.egg-info/w', 'test/v.pyc', '.hidden'):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text('')
    assert paths_of(tmp_path) == sources
    subprocess.run('git init -q && git add a.py', shell=True, cwd=str(tmp_path), check=True)
    assert paths_of(tmp_path) == ['a.py']
