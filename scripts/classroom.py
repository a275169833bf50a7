#!/usr/bin/env python3
"""Starts a class: robot1 to robotN, each in a namespace with move_to_goal and gamepad, one master.

    rosrun tb3_labs classroom.py 12
    rostopic pub -1 /robot2/ctrl_relinq std_msgs/Bool true      robot2 drives

roslaunch has no loops. So this program writes a launch file, and then becomes a roslaunch, which
reads the file from its standard input.
"""
import os
import sys
import tempfile
from xml.sax.saxutils import escape

from tb3_labs.command_line import Parser
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODEL_VARIABLE, MODELS

#: Highest number of robots (MOST), and of simulated robots in one process (IN_ONE_PROCESS).
MOST, IN_ONE_PROCESS = 200, 12
ROBOT = '''\
  <group ns="robot{number}">
    <node pkg="tb3_labs" type="move2goal_tf.py" name="move_to_goal" clear_params="true">
      <rosparam>{{model: {model}, law: {law}}}</rosparam>
      <rosparam>{set}</rosparam>
    </node>
    <node pkg="tb3_labs" type="gamepad.py" name="gamepad" clear_params="true">
      <param name="model" value="{model}"/>
    </node>
  </group>
'''
PROCESS = '''\
  <node pkg="tb3_labs" type="fake_turtlebot3.py" name="turtlebots{place}" clear_params="true">
    <param name="robots" value="{robots}"/> <param name="first_robot" value="{first}"/>
    <param name="imu_rate" value="{imu_rate}"/> <param name="model" value="{model}"/>
    <param name="mystery" value="{mystery}"/>
  </node>
'''
PANEL = '''\
  <include file="$(find tb3_labs)/launch/panel.launch">
    <arg name="robots" value="{robots}"/> <arg name="model" value="{model}"/>
  </include>
'''


def launch_file(asked):
    """The text of the launch file for the arguments of a command line."""
    parts = [ROBOT.format(number=number, model=asked.model, law=asked.law, set=escape(asked.set))
             for number in range(1, asked.robots + 1)]
    for place in range(0 if asked.real else (asked.robots - 1) // IN_ONE_PROCESS + 1):
        before = IN_ONE_PROCESS * place
        parts.append(PROCESS.format(
            place=place, first=before + 1, robots=min(IN_ONE_PROCESS, asked.robots - before),
            imu_rate=asked.imu_rate, mystery=asked.mystery, model=asked.model))
    if asked.web:
        parts.append(PANEL.format(robots=asked.robots, model=asked.model))
    return '<launch>\n{}</launch>\n'.format(''.join(parts))


def main(words):
    """Become roslaunch."""
    parser = Parser(prog='classroom.py', description=__doc__.splitlines()[0],
                    epilog='Example: rosrun tb3_labs classroom.py 12 --mystery 1')
    parser.add_argument('robots', metavar='N', type=int, help='number of robots, 1 to 200')
    parser.add_argument('--real', action='store_true', help='the robots are real; their bringups '
                        'run in these namespaces, with multi_robot_name:=robot2')
    parser.add_argument('--web', action='store_true', help='all robots on a page in a browser')
    parser.add_argument('--mystery', metavar='NUMBER', type=int, default=0,
                        help='robot n hides the fault of number NUMBER + n - 1')
    parser.add_argument('--model', choices=sorted(MODELS),
                        default=os.environ.get(MODEL_VARIABLE) or DEFAULT_MODEL,
                        help='default: %(default)s')
    parser.add_argument('--law', default='precise', choices=('precise', 'lab'),
                        help="precise, or lab for the course's own law; default: %(default)s")
    parser.add_argument('--set', default='{}', metavar='YAML',
                        help="parameters of every move_to_goal, such as '{max_linear: 0.1}'")
    parser.add_argument('--imu-rate', type=float, default=60.0, metavar='RATE',
                        help='samples of the IMU of each simulated robot [1/s]; '
                             'default: %(default)g')
    asked = parser.parse_args(words)
    if not 1 <= asked.robots <= MOST:
        parser.error('N = {} is not valid: a whole number from 1 to {}'.format(asked.robots, MOST))
    with tempfile.TemporaryFile('w+') as file:
        file.write(launch_file(asked))
        file.seek(0)
        os.dup2(file.fileno(), sys.stdin.fileno())
    os.execvp('roslaunch', ['roslaunch', '-'])


if __name__ == '__main__':
    main([word for word in sys.argv[1:] if ':=' not in word])
