"""Property tests are repeatable: the same examples on every machine, none stored. Tests run without ROS
as well, as in an editor: those that need it are skipped."""
import gc
import importlib.util
import pkgutil
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pages import ROOT

#: Parts of ROS, and packages that a set-up installs beside it.
WITH_ROS = {
    'actionlib', 'actionlib_msgs', 'diagnostic_msgs', 'diagnostic_updater', 'dynamic_reconfigure', 'genmsg', 'genpy',
    'geometry_msgs', 'move_base_msgs', 'nav_msgs', 'rosbag', 'rosgraph', 'rosgraph_msgs', 'roslaunch', 'roslib',
    'rosnode', 'rospkg', 'rosservice', 'rostest', 'rosunit', 'rospy', 'sensor_msgs', 'std_msgs', 'std_srvs',
    'tf2_msgs', 'tf2_ros', 'visualization_msgs', 'matplotlib', 'pynput', 'tornado', 'yaml',
    'tb3_labs.msg', 'tb3_labs.srv'}


class WithoutRos:
    """An import of what is missing skips the test, or its file."""

    @staticmethod
    def find_spec(name, *_):
        if name in WITH_ROS:
            pytest.skip('needs {}, and {} has none'.format(name, sys.executable), allow_module_level=True)


if not importlib.util.find_spec('rospy'):
    sys.path.append(str(ROOT / 'src'))
    sys.meta_path.append(WithoutRos)

# programs and the roll-outs have tests, too
sys.path += [str(ROOT / folder) for folder in (
    'test', 'test/benchmark', 'test/ros', 'scripts', 'doc/instructor', 'launch/checks')]

settings.register_profile('repeatable', derandomize=True, deadline=None, database=None,
                          max_examples=50)
settings.load_profile('repeatable')


def pytest_addoption(parser):
    parser.addoption('--first-cases', action='store_true', help='of each test the first case alone')


def pytest_collection_modifyitems(config, items):
    if config.getoption('--first-cases'):
        first = {}
        items[:] = [item for item in items
                    if first.setdefault((item.fspath, item.name.partition('[')[0]), item) is item]


def pytest_collection_finish():
    """The objects of the test files stay to the end, so the garbage collector need not look through
    them again and again; for the tests that count objects that is most of their time."""
    wake_hypothesis()
    gc.collect()
    gc.freeze()


@given(st.none())
def wake_hypothesis(_nothing):
    """At its first run hypothesis asks the collector about the random generators; nothing is frozen
    then."""


@pytest.fixture(scope='session')
def namesakes(tmp_path_factory):
    """A folder with a file of the name of each module that Python finds. One that is imported writes its name
    into `imported`."""
    folder, names = tmp_path_factory.mktemp('namesakes'), {module.name for module in pkgutil.iter_modules()}
    assert names > {'copy', 'random', 'rospy', 'numpy', 'yaml', 'runpy'}
    # ROS's own hook imports __future__; Python 3.13 itself imports the last two for each `python3 -c`
    for name in names - {'tb3_labs', '__future__', 'linecache', 'traceback'}:
        (folder / (name + '.py')).write_text('open({!r}, "a").write({!r})\n'.format(
            str(folder / 'imported'), name + ' '))
    return folder


@pytest.fixture
def among_namesakes(namesakes, monkeypatch):
    """The test's programs start there, as a student's in a folder with a copy.py, and import none of them."""
    monkeypatch.chdir(namesakes)
    yield
    imported = namesakes / 'imported'
    said = imported.read_text() if imported.exists() else ''
    imported.write_text('')
    assert said == ''
