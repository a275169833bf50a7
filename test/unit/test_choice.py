"""The node of a lab is found in repositories as real students keep them."""
import pytest

from tb3_labs.marking.choice import NoNode, SourceFile, choose
from tb3_labs.marking.labs import LABS

TURN, PAD = LABS['turn'], LABS['gamepad']
MOUSE_ONLY = "class Controller:\n    rospy.Subscriber('mouse_info', M, f)\nrospy.init_node('controller')"
IMU_TOO = MOUSE_ONLY + "\nrospy.Subscriber('imu', Imu, f)"


def repository(**texts):
    """SourceFiles; '__' stands for '/', and the first folder is a package if it has a digit."""
    files = []
    for name, text in texts.items():
        path = name.replace('__', '/') + '.py'
        first = path.split('/')[0]
        files.append(SourceFile(path, first if any(c.isdigit() for c in first) else '', text))
    return files


def test_of_lab1_lab2_and_lab3_it_is_lab2():
    files = repository(lab1__src__turtlebot_controller=MOUSE_ONLY,
                       lab2__src__turtlebot_controller=IMU_TOO,
                       lab3__src__turtlebot_controller=IMU_TOO)
    path, remarks = choose(TURN, files)
    assert path == 'lab2/src/turtlebot_controller.py'
    assert remarks == [
        '3 files can be the node; judged was lab2/src/turtlebot_controller.py, because it is in the '
        'package lab2. The others: lab3/src/turtlebot_controller.py, '
        'lab1/src/turtlebot_controller.py.']


@pytest.mark.parametrize('texts, expected, said', [
    # the package goes before the name
    (dict(lab1__turtlebot_controller=IMU_TOO, lab2__src__controller=IMU_TOO),
     'lab2/src/controller.py', 'in the package lab2'),
    # the name goes before the deeds
    (dict(lab2__src__turtlebot_controller='', lab2__src__old=IMU_TOO),
     'lab2/src/turtlebot_controller.py', 'the usual name'),
    # the deeds go before the folder
    (dict(lab2__scripts__turtlebot_controller=MOUSE_ONLY,
          lab2__src__turtlebot_controller=IMU_TOO), 'lab2/src/turtlebot_controller.py',
     'it listens to imu'),
    # a package that is called nearly so goes before any other, but lab20 is no lab2
    (dict(lab2_final__turtlebot_controller=IMU_TOO, a__turtlebot_controller=IMU_TOO),
     'lab2_final/turtlebot_controller.py', 'in the package lab2'),
    (dict(lab20__turtlebot_controller=IMU_TOO, a__turtlebot_controller=IMU_TOO),
     'a/turtlebot_controller.py', 'it comes first (there is no package lab2)'),
    # a helper of lab2 is not the node of lab2
    (dict(lab1__turtlebot_controller=MOUSE_ONLY, lab2__helper='x = 1'),
     'lab1/turtlebot_controller.py', ''),
    # the node's class and name tell it, too
    (dict(lab2__src__node=MOUSE_ONLY), 'lab2/src/node.py',
     'There is no turtlebot_controller.py; judged was lab2/src/node.py, which has the class '
     'Controller and is the node controller.'),
])
def test_package_then_name_then_deeds(texts, expected, said):
    path, remarks = choose(TURN, repository(**texts))
    assert path == expected
    assert said in ' '.join(remarks) if said else remarks == []


@pytest.mark.parametrize('line', [
    "rospy.Subscriber('imu', Imu, f)", 'rospy.Subscriber("/imu", Imu, f)',
    'Subscriber( name="robot3/imu" , data_class=Imu)'])
def test_listening_is_seen(line):
    assert choose(TURN, repository(a__b=line)).path == 'a/b.py'


@pytest.mark.parametrize('line', [
    "# rospy.Subscriber('imu', Imu, f)", "rospy.Subscriber('imu_raw', Imu, f)", 'class Controllers:',
    "rospy.Publisher('imu', Imu)"])
def test_what_does_not_listen_is_no_node(line):
    with pytest.raises(NoNode, match=r'There is no turtlebot_controller\.py, .*a/b\.py'):
        choose(TURN, repository(a__b=line))


def test_package_and_name_overrule():
    files = repository(lab1__turtlebot_controller=IMU_TOO, lab2__turtlebot_controller=IMU_TOO,
                       lab2__mine='')
    assert choose(TURN, files, package='lab1').path == 'lab1/turtlebot_controller.py'
    assert choose(TURN, files, name='mine.py').path == 'lab2/mine.py'
    with pytest.raises(NoNode, match='There is no mine.py in a package lab1'):
        choose(TURN, files, package='lab1', name='mine.py')


def test_a_lab_with_several_usual_packages():
    files = repository(lab4_gamepad__gamepad='', lab7__gamepad='', other__gamepad='')
    assert choose(PAD, files).path == 'lab4_gamepad/gamepad.py'


def test_not_all_others_are_named():
    files = repository(**{'a{}__turtlebot_controller'.format(n): '' for n in range(9)})
    assert choose(TURN, files).remarks[0].endswith('a6/turtlebot_controller.py and 2 more.')
