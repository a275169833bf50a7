#!/usr/bin/env python3
"""The students' archive, unpacked in a folder without git: it is built in a workspace of catkin,
writes the skeletons, starts the simulated robot, and marks a node by it."""
import os
import pathlib
import sys
import tempfile
import unittest

from node_case import STARTING, Program
from rosunit_internals import rosrun

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'unit'))

from students_archive import MISSING, ROOT, unpack  # noqa: E402

SOLUTION = ROOT / 'scripts' / 'imu_sub.py'
#: Paths that lead to this package are not a student's.
VARIABLES = 'CMAKE_PREFIX_PATH', 'PYTHONPATH', 'ROS_PACKAGE_PATH', 'LD_LIBRARY_PATH'
#: Of the languages of messages only Python is built, and make does not wait for a quiet machine (-l2).
SCRIPT = '''set -e
cd {folder}
export ROS_PACKAGE_PATH=src ROS_LANG_DISABLE=gencpp:geneus:genlisp:gennodejs ROS_PARALLEL_JOBS=-j2
for lab in imu turn move2goal gamepad; do
  PYTHONPATH=src/tb3_labs/src:$PYTHONPATH {python} src/tb3_labs/scripts/skeleton.py $lab src
done
catkin_make -DPYTHON_EXECUTABLE={python} -DPython_EXECUTABLE={python}
cp {solution} src/ice6/src
source devel/setup.bash
rospack find tb3_labs
rostest tb3_labs check_imu.test pkg:=ice6 type:=imu_sub.py parts:=heading
'''


@unittest.skipIf(MISSING, MISSING)
class StudentsTest(unittest.TestCase):

    def test_the_archive_is_built_and_marks_a_node(self):
        with tempfile.TemporaryDirectory(dir='/tmp') as folder:    # outside of the repository
            place = pathlib.Path(folder) / 'src' / 'tb3_labs'
            place.parent.mkdir()
            unpack(place.parent)
            program = Program(
                ['bash', '-c', SCRIPT.format(folder=folder, python=sys.executable,
                                             solution=SOLUTION)],
                environment={name: ':'.join(
                    path for path in os.environ.get(name, '').split(':') if str(ROOT) not in path)
                    for name in VARIABLES})
            try:
                status = program.wait(4.0 * STARTING)
            finally:
                program.kill()
            self.assertEqual(status, 0, program.text)
            self.assertIn('\n{}\n'.format(place), program.text)
            self.assertEqual(program.text.count(' is written. '), 4)
            self.assertIn('RESULT: SUCCESS', program.text)


if __name__ == '__main__':
    rosrun('students', StudentsTest)
