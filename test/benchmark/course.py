#!/usr/bin/env python3
"""Marks a course of forty submissions twice: are the marks those that a person would give?

    source scripts/setup.sh
    test/benchmark/course.py [-j JOBS]                  about 20 minutes with two jobs
    test/benchmark/course.py --write FOLDER             writes the submissions alone

All submissions are for the IMU lab. Each has the shape of a real one: repositories of a whole course
with a node of the same name in several labs, packages that ask for what no marking machine has,
messages with other names, copies, mixtures, broken ones. The expected losses are written beside each
shape. Reported are wrong marks, marks that differ between the two runs, processes that are left,
and the memory of mark.py.
"""
import argparse
import csv
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

NODES = Path(__file__).resolve().parents[1] / 'ros' / 'student_nodes'
#: As in the handout, the message comes from lab1.
NODE = (NODES / 'turtlebot_controller.py').read_text().replace('from lab2.msg', 'from lab1.msg')
PARTS = 'turns,mouse'
EVERYTHING = 'everything'
MOUSE = {'mouse_drives', 'mouse_dead_zone', 'mouse_off'}
MANIFEST = (
    '<package format="2"><name>{}</name><version>0.0.0</version><description>-</description>'
    '<maintainer email="a@example.org">-</maintainer><license>-</license><buildtool_depend>catkin'
    '</buildtool_depend><depend>rospy</depend><depend>turtlebot3_bringup</depend></package>')
RECIPE = '''cmake_minimum_required(VERSION 3.0)
project({})
find_package(catkin REQUIRED COMPONENTS rospy std_msgs turtlebot3_bringup apriltag_ros message_generation)
add_message_files(FILES MouseController.msg)
generate_messages(DEPENDENCIES std_msgs)
catkin_package()
'''
MESSAGE = 'Header header\nstd_msgs/Bool status\nfloat32 xPos\nfloat32 yPos\n'
OTHER_MESSAGE = 'Header header\nstring name\nbool activestatus\nfloat64 xPos\nfloat64 yPos\nfloat64 zPos\n'
LAB1 = {'lab1/package.xml': MANIFEST.format('lab1'), 'lab1/CMakeLists.txt': RECIPE.format('lab1'),
        'lab1/msg/MouseController.msg': MESSAGE}
LAB2 = {'lab2/package.xml': MANIFEST.format('lab2')}
PLACE = 'lab2/src/turtlebot_controller.py'


def node(*changes):
    """The handout's node with these replacements."""
    code = NODE
    for old, new in changes:
        assert old in code, old
        code = code.replace(old, new)
    return code


def course(code=NODE, place=PLACE, **more):
    """The usual files of a submission: lab1 with the message, lab2 with the node."""
    return dict(dict(LAB1, **LAB2), **dict({place: code}, **more))


def below(folder, files):
    """The same files in a folder."""
    return {folder + '/' + path: text for path, text in files.items()}


def without(files, *paths):
    """The files but for these."""
    return {path: text for path, text in files.items() if path not in paths}


WHOLE = dict(course(), **{
    'README.md': '# my course', 'ice5/package.xml': MANIFEST.format('ice5'),
    'ice5/src/chatter.py': 'import rospy\n', 'ice6/src/imu_sub.py': (NODES / 'imu_sub.py').read_text(),
    'lab1/src/turtlebot_controller.py': 'import rospy\nclass Controller:\n    pass\n',
    'lab3/package.xml': MANIFEST.format('lab3'), 'lab3/CMakeLists.txt': 'this is no cmake(',
    'lab3/src/turtlebot_controller.py': node(('self.curr_yaw + 90', 'self.curr_yaw + 45')),
    'final_project/package.xml': MANIFEST.format('final_project'),
    'final_project/launch/<robot>.launch': '<launch/>', 'lab2/Screenshot 1.png': b'\x89PNG' * 1000})
NUMBERS = '    K_HDG = 0.1\n    HDG_TOL = 10\n'
PYTHON_2 = NODE.replace('print("Controller exiting. Halting robot.")',
                        'print "Controller exiting. Halting robot."')
WITH_TF = node(
    ('from squaternion import Quaternion\n', 'import math\nimport tf\n'),
    ('q = Quaternion(imu.orientation.w, imu.orientation.x, imu.orientation.y,\n'
     '                           imu.orientation.z)\n            yaw = q.to_euler(degrees=True)[2]',
     'q = imu.orientation\n            yaw = math.degrees(tf.transformations.euler_from_quaternion(\n'
     '                [q.x, q.y, q.z, q.w])[2])'))
OTHER_NAMES = node(('mouse_info.status.data', 'mouse_info.activestatus'))
NO_MOUSE = node(("        rospy.Subscriber('mouse_info', MouseController, self.callback_mouse)\n", ''))
WRONG_WAY = node(('self.curr_yaw + 90', 'self.curr_yaw - 90'),
                 ('self.goal_yaw = self.curr_yaw - 90\n                self.turning = True\n            else',
                  'self.goal_yaw = self.curr_yaw + 90\n                self.turning = True\n            else'))
UNUSED = ('import rospy\n', 'import rospy\nimport cv3\nfrom apriltag_ros.msg import Tags\nimport tf\n')
GONE = EVERYTHING

#: student -> (files, criteria that are lost)
COURSE = {
    'a whole repository': (WHOLE, set()),
    'a copy of it': (WHOLE, set()),
    'a platform\'s folder & name': (below('lab-main (2)', WHOLE), set()),
    'a workspace': (below('catkin_ws/src', course()), set()),
    'a workspace, built': (dict(below('catkin_ws/src', course()), **{
        'catkin_ws/devel/lib/lab2/turtlebot_controller.py': 'old', 'catkin_ws/build/x': 'y'}), set()),
    'controller.py': (course(place='lab2/src/controller.py'), set()),
    'Turtlebot_Controller.py': (course(place='lab2/scripts/Turtlebot_Controller.py'), set()),
    'another name': (course(place='lab2/src/my_node.py'), set()),
    'beside package.xml': (course(place='lab2/turtlebot_controller.py'), set()),
    'no package.xml': (without(course(), 'lab2/package.xml'), set()),
    'no manifest at all': (without(course(), 'lab1/package.xml', 'lab1/CMakeLists.txt',
                                   'lab2/package.xml'), set()),
    'a package twice': (dict(course(), **below('old', course(node(
        ('self.curr_yaw + 90', 'self.curr_yaw + 45'))))), set()),
    'lab2_final': ({path.replace('lab2', 'lab2_final'): text for path, text in course().items()}, set()),
    'imports that nobody uses': (course(node(UNUSED)), set()),
    'other names in the message': (course(OTHER_NAMES, **{'lab1/msg/MouseController.msg':
                                                          OTHER_MESSAGE}), set()),
    'a message in lab2': (without(course(
        node(('from lab1.msg', 'from lab2.msg')), **{'lab2/msg/MouseController.msg': MESSAGE}),
        *LAB1), set()),
    'a broken message beside': (course(**{'lab1/msg/Broken.msg': 'no such type\n'}), set()),
    'tf for squaternion': (course(WITH_TF), set()),
    'a module beside the node': (course(
        node((NUMBERS, '    from numbers_of_mine import K_HDG, HDG_TOL\n')),
        **{'lab2/src/numbers_of_mine.py': 'K_HDG = 0.1\nHDG_TOL = 10\n'}), set()),
    'a module by setup.py': (course(
        node((NUMBERS, '    from lab2.numbers import K_HDG, HDG_TOL\n')),
        place='lab2/scripts/turtlebot_controller.py', **{
            'lab2/setup.py': 'no python(', 'lab2/src/lab2/__init__.py': '',
            'lab2/src/lab2/numbers.py': 'K_HDG = 0.1\nHDG_TOL = 10\n'}), set()),
    'Windows': (course(('\ufeff' + NODE).replace('\n', '\r\n')), set()),
    'no first line': (course(NODE.split('\n', 1)[1]), set()),
    'slashes': (course(node(("'imu'", "'/imu'"), ("'cmd_vel'", "'/cmd_vel'"),
                            ("'mouse_info'", "'/mouse_info'"))), set()),
    'anonymous': (course(node(("'controller')", "'controller', anonymous=True)"))), set()),
    'called tb3_labs': ({path.replace('lab2', 'tb3_labs'): text.replace('lab2', 'tb3_labs')
                         for path, text in course().items()}, set()),
    'large files': (course(**{'lab2/run.bag': b'x' * 30000000, 'video.mp4': b'x' * 30000000}), set()),
    'Zoë Müller': (course(NODE.replace('the IMU lab', 'Zoë: the IMU lab')), set()),
    'never listens to the mouse': (course(NO_MOUSE), MOUSE),
    'the wrong way round': (course(WRONG_WAY), {'left', 'right', 'short_way'}),
    'too fast': (course(node(('MAX_ANG_Z = 1.5', 'MAX_ANG_Z = 2.5'))), {'clamped'}),
    'no answer to nonsense': (course(node(('valid inputs are l and r', 'no'))), {'answers_nonsense'}),
    'stops early': (course(node(('HDG_TOL = 10', 'HDG_TOL = 40'))), {'left', 'right', 'short_way'}),
    'Python 2': (course(PYTHON_2), GONE),
    'ends at once': (course(node(('self.curr_yaw = 0\n', 'self.curr_yaw = yaw\n'))), GONE),
    'wants an argument': (course(node(('K_HDG = 0.1', 'import sys\n    K_HDG = float(sys.argv[3])'))), GONE),
    'never listens': (course('import time\nwhile True:\n    time.sleep(1)\n'), GONE),
    'nothing': ({'README.md': 'later'}, GONE),
    'a screenshot of the code': ({'lab2.pdf': b'%PDF-1.4'}, GONE),
    'only lab1': (LAB1, GONE),
    'half a file': (course(NODE[:len(NODE) // 2]), GONE),
}


def write(folder):
    """Write all submissions into a folder."""
    for student, (files, _) in COURSE.items():
        for name, content in files.items():
            path = folder / student / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
    links = folder / 'a workspace' / 'catkin_ws' / 'src'
    (links / 'CMakeLists.txt').symlink_to('/opt/ros/noetic/share/catkin/cmake/toplevel.cmake')
    (links / 'round').symlink_to(links)


def mark(submissions, folder, jobs):
    """Mark them; (student -> criteria that were lost, student -> points, seconds)."""
    begun = time.monotonic()
    subprocess.run(['rosrun', 'tb3_labs', 'mark.py', str(submissions), '--lab', 'turn', '-o',
                    str(folder), '--parts', PARTS, '--jobs', str(jobs)])
    with open(str(folder / 'marks.csv'), newline='', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    names = list(rows[0])
    criteria = [name for name in names[names.index('of') + 1:names.index('node')]
                if not name.startswith('extra_')]
    lost = {row['student']: {name for name in criteria if row[name] in ('0', '')} for row in rows}
    return lost, criteria, time.monotonic() - begun


def main():
    """Write, mark twice, compare; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('-j', '--jobs', type=int, default=2, help='submissions at a time')
    parser.add_argument('--write', metavar='FOLDER', type=Path, help='write the submissions alone')
    given = parser.parse_args()
    if given.write:
        write(given.write)
        return 0
    with tempfile.TemporaryDirectory(prefix='course_') as place:
        submissions = Path(place) / 'submissions'
        write(submissions)
        before = processes()
        runs = [mark(submissions, Path(place) / 'marks {}'.format(run), given.jobs) for run in (1, 2)]
        left = processes() - before
    first, criteria, _ = runs[0]
    wrong = 0
    for student, (_, expected) in COURSE.items():
        expected = set(criteria) if expected == EVERYTHING else expected
        for number, (lost, _, _) in enumerate(runs, 1):
            if lost.get(student) != expected:
                wrong += 1
                print('WRONG, run {}: {}: lost {}, expected {}'.format(
                    number, student, sorted(lost.get(student, ['no mark'])), sorted(expected)))
    differing = [student for student in COURSE if runs[0][0].get(student) != runs[1][0].get(student)]
    print('{} submissions, {} criteria each; wrong: {}; different in the second run: {}'.format(
        len(COURSE), len(criteria), wrong, differing or 'none'))
    print('{:.0f} s and {:.0f} s; processes left: {}; largest process: {:.0f} MB'.format(
        runs[0][2], runs[1][2], sorted(left) or 'none',
        resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024))
    return 1 if wrong or differing or left else 0


def processes():
    """The numbers and commands of the processes of ROS that run."""
    lines = subprocess.check_output(['ps', '-eo', 'pid,args'], universal_newlines=True).splitlines()
    return {line.strip() for line in lines if 'rosmaster' in line or 'check_lab' in line
            or 'turtlebot' in line} - {str(os.getpid())}


if __name__ == '__main__':
    sys.exit(main())
