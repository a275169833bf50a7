"""The students' archive has no part of the solutions, and all that its own files need. students.test
builds it."""
import ast
import os
import re

import pytest
from students_archive import EXCLUDE, LIST, MISSING, ROOT, unpack
from test_skeletons import answers

from tb3_labs.marking.marks import LABS

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)
LAB_NODES = ['scripts/turtlebot_controller.py', 'scripts/move2goal_tf.py', 'scripts/gamepad.py']
PLAIN = ['scripts/imu_sub.py'] + [path.replace('/', '/plain_') for path in LAB_NODES]
SOLUTIONS = LAB_NODES + ['src/tb3_labs/nodes/{}/ros_node.py'.format(room)
                         for room in ('controller', 'gamepad', 'move_to_goal')]
#: Lines of the solutions that other files may have too.
IDIOMS = {'rospy.on_shutdown(self._close)', 'self._lock = threading.Lock()',
          'self._changed.notify_all()', 'except ValueError as error:',
          'except rospy.ROSException:', "rospy.logwarn('%s', error)",
          "rospy.loginfo('Pose reset successfully.')"}     # which a skeleton has, too


def text_of(path):
    """Returns the text of a file; '' for a picture."""
    try:
        return path.read_text(encoding='utf-8')
    except UnicodeDecodeError:
        return ''


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp('students')
    unpack(place)
    assert [path.name for path in place.iterdir()] == ['tb3_labs']
    return place / 'tb3_labs'


@pytest.fixture(scope='module')
def archive(folder):
    return {path.relative_to(folder).as_posix(): text_of(path)
            for path in sorted(folder.rglob('*')) if path.is_file()}


def imports_of(text):
    """Yields each name that is imported from this package, and the files that may define it."""
    for node in ast.walk(ast.parse(text)):
        names = [alias.name for alias in getattr(node, 'names', ()) if isinstance(node, ast.Import)]
        if isinstance(node, ast.ImportFrom):
            names = ['{}.{}'.format(node.module, alias.name) for alias in node.names]
        for name in names:
            if re.match(r'tb3_labs\.(?!(msg|srv)\b)', name):
                place = 'src/' + name.replace('.', '/')     # a module, or a name in a module
                yield name, {place + '.py', place + '/__init__.py',
                             place.rpartition('/')[0] + '.py',
                             place.rpartition('/')[0] + '/__init__.py'}


def test_each_line_of_the_list_leaves_something_out():
    first, *others = LIST.read_text(encoding='utf-8').splitlines()
    assert first == '.' and all(line.startswith(EXCLUDE) for line in others)
    assert [line for line in others if not (ROOT / line[len(EXCLUDE):]).exists()] == []
    assert not re.search(r'[\s*?[]', ''.join(others))    # the shell splits the list into words


def test_the_solutions_are_left_out_and_what_students_need_is_there(archive, folder):
    assert not set(archive) & set(SOLUTIONS + PLAIN)
    assert not [path for path in archive if path.startswith('doc/instructor/')]
    assert {'launch/fake_robot.launch', 'launch/checks/check_turn.test', 'scripts/lab_report.py',
            'scripts/mark.py', 'scripts/setup.sh', 'msg/MouseController.msg',
            'srv/ResetPose.srv', 'doc/imu_lab.md', 'CMakeLists.txt', 'LICENSE', '.gitignore',
            'src/tb3_labs/geometry/se2.py', 'README.md', 'doc/panel.png'} <= set(archive)
    assert os.access(str(folder / 'scripts' / 'setup.sh'), os.X_OK)
    assert 'demo.sh' not in archive['README.md'] and 'tar -xzf students.tar.gz -C ~' in archive['README.md']
    assert [path for path in archive if path.startswith(('test/', '.ci', 'CHANGELOG'))
            or path == 'scripts/test.sh'] == ['test/.run_test.py']      # it starts a check


def test_no_solution_stands_in_another_file(archive):
    lines = set()
    for path in SOLUTIONS:
        text = (ROOT / path).read_text(encoding='utf-8')
        bodies = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
        lines |= {line.strip() for body in bodies
                  for line in text.split('\n')[body.lineno:body.end_lineno]}
    lines = {line for line in lines if len(line) > 25 and not line.startswith(('def ', '#', '"'))}
    assert len(lines) > 100
    assert {(path, line) for path, text in archive.items() if path.endswith('.py')
            for line in map(str.strip, text.split('\n')) if line in lines - IDIOMS} == set()


@pytest.mark.parametrize('lab', sorted(LABS))
def test_no_todo_is_filled_in_any_file(lab, archive):
    lines = [re.sub(r'\s+', '', re.sub(r'^ *self\.\w+ = (?=.*\()', '', line)) for line in answers(lab)]
    lines = [line for line in lines if len(line) > 20 and not line.startswith(('from', 'import'))]
    assert len(lines) > 2
    closed = {path: re.sub(r'\s+', '', text) for path, text in archive.items()
              if not path.startswith('doc/skeletons/')}      # test_skeletons.py looks at these
    assert [(path, line) for path, text in closed.items() for line in lines if line in text] == []


def test_every_import_leads_to_a_file_of_it_and_every_module_serves_one(archive):
    """A module that nothing in the archive uses belongs to a solution."""
    modules = {'launch': 'launch_arguments'}    # launch/run.py renames it
    used = {'src/tb3_labs/ros/{}.py'.format(modules.get(name, name)) for path, text in archive.items()
            if not path.endswith('.py') for name in re.findall(r'run\.py"? (\w+)', text)}
    # a program that is started by its path
    used |= {'{}/{}'.format(path.rpartition('/')[0], name) for path, text in archive.items()
             for name in re.findall(r"'(\w+\.py)'", text)}
    used.add('src/tb3_labs/watch/probe/sitecustomize.py')    # Python's start imports it
    for path, text in archive.items():
        for name, files in imports_of(text) if path.endswith('.py') else ():
            package, _, own = name.rpartition('.')    # or a name of the package's own file
            begin = re.compile(r'^(def |class |(\w+, )*){}\b'.format(own), re.MULTILINE)
            assert files & set(archive) or begin.search(archive.get(
                'src/{}/__init__.py'.format(package.replace('.', '/')), '')), (path, name)
            used |= files - {path}
    assert [path for path in archive if path.startswith('src/') and path.endswith('.py')
            and path not in used and not path.endswith('__init__.py')] == []


def test_nothing_that_it_starts_or_includes_is_missing(archive):
    for path, text in archive.items():
        if path.endswith(('.launch', '.test', '.launch.in')):
            for name in re.findall(r'pkg="tb3_labs"\s+type="([^"]+)"', text):
                assert {'scripts/' + name, 'test/' + name} & set(archive), (path, name)
            for name in re.findall(r'\$\(find tb3_labs\)/([\w./-]+\.\w+)', text):
                assert name in archive, (path, name)


def test_no_file_names_a_page_and_no_page_names_a_file_that_is_missing(archive, folder):
    here = {path.relative_to(ROOT).as_posix()
            for name in ('doc', 'launch', 'scripts', 'src', 'test')
            for path in (ROOT / name).rglob('*') if path.is_file()}
    gone = here - set(archive)
    gone |= {re.sub('^src/tb3_labs/', '', path) for path in gone}
    for path, text in archive.items():
        for page in re.findall(r'[\w./-]*\w\.(?:md|rst)\b', re.sub('<!--.*?-->|```.*', '', text)):
            assert any(place.joinpath(page).exists() for place in (
                folder, folder / 'doc', (folder / path).parent)), (path, page)
        if path.endswith('.md'):
            for target in re.findall(r'\]\(([^)#]+)', text):
                assert '://' in target or (folder / path).parent.joinpath(target).exists(), (path, target)
            text = re.sub('<!--.*?-->', '', text)
            assert set(re.findall(r'[\w.-]+(?:/[\w.-]+)+', text)) & gone == set(), path
            assert 'instructor/' not in text, path
