"""The students' archive is unpacked in a workspace without git, and built. It writes the skeletons,
and checks a node."""
import inspect
import os
import pathlib
import sys
import tempfile
import unittest

import rospy
import squaternion

from node_case import STARTING, TestProgram

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'unit'))

from students_archive import MISSING, ROOT, unpack

SOLUTION = ROOT / 'scripts' / 'imu_sub.py'
#: A student's variables have no path of this package.
VARIABLES = 'CMAKE_PREFIX_PATH', 'PYTHONPATH', 'ROS_PACKAGE_PATH', 'LD_LIBRARY_PATH'
#: Only Python's messages are built. make does not wait for a quiet machine (-l2).
SCRIPT = '''set -e
cd {folder}
export ROS_PACKAGE_PATH=src ROS_LANG_DISABLE=gencpp:geneus:genlisp:gennodejs ROS_PARALLEL_JOBS=-j2
venv=$PWD/src/tb3_labs/build/.ws/venv
mkdir -p src/tb3_labs/build
touch src/tb3_labs/build/CATKIN_IGNORE
{python} -m venv --system-site-packages --without-pip $venv
cp -r {squaternion}* $venv/lib/python3*/site-packages
export PATH=$venv/bin:$PATH
for lab in imu turn move2goal gamepad; do
  PYTHONPATH=src/tb3_labs/src:$PYTHONPATH python3 src/tb3_labs/scripts/skeleton.py $lab src
done
catkin_make -DPYTHON_EXECUTABLE=$venv/bin/python3 -DPython_EXECUTABLE=$venv/bin/python3
cp {solution} src/ice6/src
source devel/setup.bash
rospack find tb3_labs
rostest tb3_labs check_imu.test pkg:=ice6 type:=imu_sub.py parts:=heading
'''


@unittest.skipIf(MISSING, MISSING)
@unittest.skipIf('isAlive(' in inspect.getsource(rospy.core) and sys.version_info >= (3, 9),
                 "this rospy ends cleanly only in the shell of scripts/setup.sh (doc/setup.md)")
class StudentsTest(unittest.TestCase):
    IS_NODE = False

    def test_the_archive_is_built_and_checks_a_node(self):
        with tempfile.TemporaryDirectory(dir='/tmp') as folder:    # outside of the repository
            place = pathlib.Path(folder) / 'src' / 'tb3_labs'
            place.parent.mkdir()
            unpack(place.parent)
            program = TestProgram(
                ['bash', '-c', SCRIPT.format(
                    folder=folder, python=sys.executable, solution=SOLUTION,
                    squaternion=pathlib.Path(squaternion.__file__).parent)],
                environment={name: ':'.join(
                    path for path in os.environ.get(name, '').split(':') if str(ROOT) not in path)
                    for name in VARIABLES})
            try:
                status = program.wait(16.0 * STARTING)
            finally:
                program.kill()
            self.assertEqual(status, 0, program.text)
            self.assertIn('\n{}\n'.format(place), program.text)
            self.assertEqual(program.text.count(' is written. '), 4)
            self.assertRegex(program.text, r'\n(\d+) of \1 points')
            self.assertIn('RESULT: SUCCESS', program.text)
