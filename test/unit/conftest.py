"""Property tests are repeatable: the same examples on every machine, none stored. Tests run without ROS
as well, as in an editor: those that need it are skipped."""
import gc
import importlib.util
import os
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

#: Parts of ROS, and packages that a set-up installs beside it.
WITH_ROS = {
    'actionlib', 'actionlib_msgs', 'diagnostic_msgs', 'diagnostic_updater', 'dynamic_reconfigure', 'genmsg', 'genpy',
    'geometry_msgs', 'move_base_msgs', 'nav_msgs', 'rosbag', 'rosgraph', 'rosgraph_msgs', 'roslaunch', 'roslib',
    'rosnode', 'rospkg', 'rosservice', 'rostest', 'rosunit', 'rospy', 'sensor_msgs', 'std_msgs', 'std_srvs',
    'tf2_msgs', 'tf2_ros', 'visualization_msgs', 'matplotlib', 'pynput', 'tornado', 'yaml', 'tb3_labs.msg',
    'tb3_labs.srv'}


class WithoutRos:
    """An import of what is missing skips the test, or its file."""

    @staticmethod
    def find_spec(name, *_):
        if name in WITH_ROS:
            pytest.skip('needs {}, and {} has none'.format(name, sys.executable), allow_module_level=True)


if not importlib.util.find_spec('rospy'):
    sys.path.append(os.path.join(os.path.dirname(__file__), os.pardir, os.pardir, 'src'))
    sys.meta_path.append(WithoutRos)

# the roll-outs of test/benchmark have tests, too
sys.path.insert(0, os.path.join(os.path.dirname(__file__), os.pardir, 'benchmark'))

settings.register_profile('repeatable', derandomize=True, deadline=None, database=None,
                          max_examples=50)
settings.load_profile('repeatable')


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
