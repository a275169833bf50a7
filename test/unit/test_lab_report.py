"""A report of bags whose numbers are known: a drive that misses by 12 mm and 0.7 deg, two real
recordings, and bags that are none."""
import csv
import math
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

rosbag = pytest.importorskip('rosbag', reason='rosbag is not installed')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

import rospy                                                                    # noqa: E402
from geometry_msgs.msg import PoseStamped, Twist                                # noqa: E402
from nav_msgs.msg import Odometry                                               # noqa: E402
from sensor_msgs.msg import Imu                                                 # noqa: E402
from std_msgs.msg import String                                                 # noqa: E402

from tb3_labs.quaternions import quaternion_from_yaw, yaw_from_quaternion       # noqa: E402
from tb3_labs.report.run_data import yaws_of                                    # noqa: E402
from tb3_labs.ros.bag_reader import BagProblem, read_run                        # noqa: E402
from tb3_labs.ros.conversions import to_pose_stamped, to_quaternion, to_twist   # noqa: E402
from tb3_labs.se2 import Pose2                                                  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDINGS = pathlib.Path(os.environ.get('TB3_LABS_RECORDINGS', ROOT / '../shared/recordings'))
OFFSET = math.radians(140.0)      # of the IMU against the odometry
START = 1000.0                    # [s]
GOAL = Pose2(1.0, 0.0, 0.0)
MISS, TURNED = 0.012, math.radians(0.7)


def write(path, names='{}', gap=None, package=True):
    """A robot that starts at (2, 3, 90 deg) of odom and world, and drives 1.012 m straight on in
    6.9 s, turning 0.7 deg on the way, with `local` declared at its start."""
    with rosbag.Bag(str(path), 'w') as bag:
        def put(topic, message, time):
            bag.write(names.format(topic), message, rospy.Time.from_sec(START + time))
        world_T_local = Pose2(2.0, 3.0, math.pi / 2.0)
        for tick in range(1800):                                       # 200 Hz, 9 s
            time = tick / 200.0
            driven = min(max(time - 1.0, 0.0) / 6.9, 1.0)
            local = Pose2((1.0 + MISS) * driven, 0.0, TURNED * driven)
            odom = world_T_local @ local
            moving = 0.0 < driven < 1.0
            if gap is None or not gap[0] < time < gap[1]:
                imu = Imu(orientation=to_quaternion(odom.yaw + OFFSET))
                imu.header.stamp = rospy.Time.from_sec(START + time)
                put('imu', imu, time)
            if tick % 8 == 0:
                odometry = Odometry(child_frame_id='base_footprint')
                odometry.header = to_pose_stamped(odom, 'odom', START + time).header
                odometry.pose.pose = to_pose_stamped(odom, 'odom', 0.0).pose
                odometry.twist.twist = to_twist((1.0 + MISS) / 6.9 * moving, 0.0)
                put('odom', odometry, time)
                if package:
                    put('local_pose', to_pose_stamped(local, 'local', START + time), time)
                    put('ground_truth', to_pose_stamped(odom, 'world', START + time), time)
                    if moving:
                        put('cmd_vel', to_twist(0.15, 0.0), time)
            if package and tick in (0, 200, 1590):
                state = {0: 'waiting for control', 200: 'MOVE_FORWARD', 1590: 'GOAL_REACHED'}[tick]
                put('goal_state', String(state), time)
                put('current_goal', to_pose_stamped(GOAL, 'local', START + time), time)
    return path


def report(*words):
    """Run the script; (exit status, errors)."""
    done = subprocess.run([sys.executable, str(ROOT / 'scripts' / 'lab_report.py')] +
                          [str(word) for word in words], stderr=subprocess.PIPE,
                          stdout=subprocess.DEVNULL, universal_newlines=True, timeout=120,
                          check=False)
    return done.returncode, done.stderr


def rows_of(page):
    """Every table row of the page as a list of texts."""
    return [[re.sub('<[^>]+>', '', cell).strip() for cell in
             re.findall('<t[dh][^>]*>(.*?)</t[dh]>', row, re.S)]
            for row in re.findall('<tr>(.*?)</tr>', page, re.S)]


@pytest.mark.parametrize('names', ['/{}', '{}', '/robot3/{}'])
def test_the_table_is_right_to_a_millimetre_and_a_tenth_of_a_degree(tmp_path, names):
    bag = write(tmp_path / 'run.bag', names)
    assert report(bag) == (0, '')
    folder = tmp_path / 'run_report'
    page = (folder / 'report.html').read_text(encoding='utf-8')
    header, drive = [row for row in rows_of(page) if row and row[0] in ('drive', '1')][:2]
    values = dict(zip(header, drive))
    assert values['outcome'] == 'reached'
    for measured in ('off by', 'truly off'):
        assert float(values[measured + ' [m]']) == pytest.approx(MISS, abs=0.0005)
        assert float(values[measured + ' [deg]']) == pytest.approx(0.7, abs=0.05)
    assert float(values['time [s]']) == pytest.approx(6.95, abs=0.1)
    assert 'mean +140.0' in page
    # one file: all figures are in it, and nothing is fetched
    images = sorted(folder.glob('*.png'))
    assert len(images) >= 4 and page.count('data:image/png;base64,') == len(images)
    assert not re.search('(src|href)="?http', page)
    with open(str(folder / 'run.csv'), encoding='utf-8') as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last['odom_x_m']) == pytest.approx(2.0, abs=1e-3)
    assert float(last['odom_y_m']) == pytest.approx(4.012, abs=1e-3)
    assert float(last['local_x_m']) == pytest.approx(1.012, abs=1e-3)
    assert float(last['distance_error_m']) == pytest.approx(MISS, abs=1e-3)


def test_gaps_are_found(tmp_path):
    run = read_run(write(tmp_path / 'gap.bag', '/{}', gap=(3.0, 3.5)))
    assert np.diff(run.imu.time).max() == pytest.approx(0.505, abs=0.02)
    assert report(tmp_path / 'gap.bag')[0] == 0
    page = (tmp_path / 'gap_report' / 'report.html').read_text(encoding='utf-8')
    imu, = [row for row in rows_of(page) if row and row[0] == '/imu']
    assert '1' in imu and float(imu[3]) == pytest.approx(0.505, abs=0.02)


def test_a_bag_without_this_packages_topics_has_no_drives(tmp_path):
    bag = write(tmp_path / 'plain.bag', '/{}', package=False)
    assert report(bag, '-o', tmp_path / 'out') == (0, '')
    with open(str(tmp_path / 'out' / 'run.csv'), encoding='utf-8') as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last['local_x_m']) == pytest.approx(1.012, abs=2e-3)


def test_headings_of_many_quaternions_at_once():
    yaws = np.linspace(-3.1, 3.1, 50)
    quaternions = np.array([quaternion_from_yaw(yaw) for yaw in yaws]).T
    expected = [yaw_from_quaternion(w=w, x=x, y=y, z=z) for w, x, y, z in quaternions.T]
    assert yaws_of(*quaternions) == pytest.approx(expected)
    assert np.isnan(yaws_of(*np.zeros((4, 1)))).all()


@pytest.mark.parametrize('name, offset, way', [('burger_drive', 140.56, 4.46),
                                               ('burger_static', -105.51, 0.0)])
def test_recordings_of_a_real_robot(tmp_path, name, offset, way):
    bag = RECORDINGS / (name + '.bag')
    if not bag.exists():
        pytest.skip('the recordings are not here: {}'.format(bag))
    run = read_run(bag)
    pose = run.odometry
    steps = np.hypot(np.diff(pose.x), np.diff(pose.y))
    assert steps.sum() == pytest.approx(way, abs=0.05)
    assert report(bag, '-o', tmp_path / name)[0] == 0
    page = (tmp_path / name / 'report.html').read_text(encoding='utf-8')
    mean, = re.findall(r'mean ([+-][\d.]+)', page)
    assert float(mean) == pytest.approx(offset, abs=0.1)


def test_bags_that_are_none_are_one_line(tmp_path):
    good = write(tmp_path / 'good.bag', '/{}')
    cut = tmp_path / 'cut.bag'
    cut.write_bytes(good.read_bytes()[:200000])
    text = tmp_path / 'text.bag'
    text.write_text('no bag')
    empty = tmp_path / 'empty.bag'
    with rosbag.Bag(str(empty), 'w') as bag:
        bag.write('/cmd_vel', Twist(), rospy.Time(1))
    locked = tmp_path / 'locked'
    locked.write_text('a file, no folder')
    for words, expected in (([tmp_path / 'none.bag'], 'no such file'), ([cut], 'rosbag reindex'),
                            ([text], 'bag'), ([empty], 'no sensor_msgs/Imu'),
                            ([good, '-o', locked], 'another folder')):
        status, errors = report(*words)
        lines = [line for line in errors.splitlines() if '%' not in line]
        assert status == 1 and len(lines) == 1 and expected in lines[0], errors
    with pytest.raises(BagProblem):
        read_run(text)
