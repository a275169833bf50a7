"""The examples by numbers in the lab sheets, computed by another way than the sheets'."""
import cmath
import math
import re
import runpy
from types import SimpleNamespace

import pytest
from pages import ROOT

from tb3_labs.simulation.ros_fake_robot import PITCH, ROLL

NUMBER = r'(-?\d+(?:\.\d+)?)'


def text_of(sheet):
    """A sheet on one line."""
    return ' '.join((ROOT / 'doc' / sheet).read_text(encoding='utf-8').split())


def numbers(sheet, *words):
    """The numbers in the place of each # in `words`, which a sheet must hold."""
    pattern = re.escape(' '.join(words)).replace(r'\#', NUMBER).replace('#', NUMBER)
    found = re.search(pattern, text_of(sheet))
    assert found, words
    return [float(number) for number in found.groups()]


def test_a_place_and_a_heading_in_the_local_frame():
    x, y, theta, cos, sin = numbers('transformation_lab.md', 'the odometry showed (#, #) and # degrees, '
                                    'whose cosine is # and whose sine is #.')
    here_x, here_y, heading = numbers('transformation_lab.md',
                                      'Now the odometry shows (#, #) and # degrees.')
    local_x, local_y, local = numbers('transformation_lab.md',
                                      'So the robot is at (#, #) in B, and faces # degrees.')
    # a rotation of the plane is a multiplication by a complex number of length 1
    turn = cmath.rect(1.0, math.radians(theta))
    assert turn == pytest.approx(complex(cos, sin), abs=1e-4)
    assert complex(x, y) + turn * complex(local_x, local_y) == pytest.approx(
        complex(here_x, here_y), abs=1e-3)
    assert local == pytest.approx(heading - theta)


def test_the_values_of_the_four_states():
    """Each row of the table: the way to the goal, the error, and the law's command."""
    law = {state: numbers('transformation_lab.md', '| `{}` | {} = #'.format(state, axis))[0] for state, axis in (
        ('ROTATE_TO_GOAL', 'angular.z'), ('MOVE_FORWARD', 'linear.x'), ('ROTATE_TO_FINAL', 'angular.z'))}
    near, = numbers('transformation_lab.md', 'the goal is # m away')
    rows = re.findall(r'\| \({0}, {0}\), {0} deg \| {0} \| (?:{0} rad)? ?\| (.*?) \|'.format(NUMBER),
                      text_of('transformation_lab.md'))
    assert len(rows) == 6
    state = 'ROTATE_TO_GOAL'
    for x, y, heading, distance, error, does in rows:
        way = complex(-0.61, 0.61) - complex(float(x), float(y))
        assert float(distance) == round(abs(way), 2)
        assert math.degrees(cmath.phase(way)) == pytest.approx(135.0)
        requested = 135.0 if state == 'ROTATE_TO_GOAL' else 0.0
        turn = math.radians(requested - float(heading))
        assert state == 'MOVE_FORWARD' if error == '' else float(error) == round(turn, 2)
        done = abs(way) <= near if state == 'MOVE_FORWARD' else abs(turn) <= 0.05
        if done:
            state = re.fullmatch('next: `([A-Z_]+)`', does).group(1)
        elif state == 'MOVE_FORWARD':
            assert does == '`MOVE_FORWARD`: {:g} m/s'.format(law[state])
        else:
            assert does == '`{}`: {:.2f} rad/s'.format(state, law[state] * turn)
    assert state == 'GOAL_REACHED'


def test_the_lines_after_the_goal():
    """The line of the sheet stands before the last publish of control_loop."""
    assert 'prints this line, and at most one more line: ```text then=lab Goal reached!' in text_of(
        'transformation_lab.md')
    plain, sent = runpy.run_path(str(ROOT / 'scripts' / 'plain_move2goal_tf.py'))['MoveToGoal'], []
    node = plain.__new__(plain)
    vars(node).update(has_control=True, initial_global_x=0.0, state='ROTATE_TO_FINAL', local_x=-0.51,
                      local_y=0.51, local_yaw=0.0, goal_x=-0.61, goal_y=0.61, goal_yaw=0.0,
                      cmd_pub=SimpleNamespace(publish=sent.append))
    for _ in range(30):
        node.control_loop(None)
    assert node.state == 'GOAL_REACHED' and len(sent) == 1


def test_the_quaternion_that_the_imu_sends_at_rest():
    """A robot that leans by roll and pitch, at a yaw of 0; the odometry's has neither."""
    w, = numbers('imu_lab.md', 'orientation: w: # angular_velocity:')
    assert w == pytest.approx(math.cos(ROLL / 2.0) * math.cos(PITCH / 2.0), abs=1e-8)
