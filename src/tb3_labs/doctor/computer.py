"""This computer: its Python and packages, its gamepad and mouse, its disk."""
import glob
import importlib
import importlib.util
import os
import shutil
import sys
from typing import Iterator, Mapping, Sequence, Tuple

from tb3_labs.doctor.line import Line, fault, ok, warning

#: The packages that the labs' nodes import.
PACKAGES = ('rospy', 'numpy', 'squaternion', 'geometry_msgs.msg', 'nav_msgs.msg',
            'sensor_msgs.msg', 'tf2_ros', 'tb3_labs.srv')
#: rosbag record stops with less space than the first of these, and warns below the second [bytes].
RECORDS_NO_MORE = 1e9
RECORDS_NOT_LONG = 5e9

SOURCE = 'source scripts/setup.sh in this terminal, then rosrun tb3_labs doctor.py'


def look_at_python() -> Line:
    """The line on the interpreter and its packages. Each is really imported: a package may be there
    and lack its own packages."""
    missing = {}
    for name in PACKAGES:
        try:
            importlib.import_module(name)
        except Exception as trouble:    # a broken package may raise anything
            missing[name.partition('.')[0] if name != 'tb3_labs.srv' else 'tb3_labs'] = (
                ' '.join(str(trouble).split()) or type(trouble).__name__)
    return judge_python('.'.join(map(str, sys.version_info[:3])), sys.executable, missing,
                        os.environ.get('ROS_VERSION', '1'))


def judge_python(version: str, executable: str, missing: Mapping[str, str],
                 ros_version: str = '1') -> Line:
    """`missing`: {package: why it cannot be imported}; `ros_version`: the environment's."""
    here = 'Python {} ({})'.format(version, executable)
    if ros_version == '2':
        return fault('Python', 'a ROS 2 was sourced in this terminal, and it breaks the Python of '
                     'ROS 1', 'open a new terminal; ' + SOURCE)
    if missing:
        first, *others = missing
        return fault('Python', '{} cannot import {} ({}){}'.format(
            here, first, missing[first], ', nor ' + ', '.join(others) if others else ''), SOURCE)
    return ok('Python', here + ' has all packages')


def look_at_devices() -> Iterator[Line]:
    """The lines on gamepad and mouse."""
    yield judge_pad([(path, os.access(path, os.R_OK))
                     for path in sorted(glob.glob('/dev/input/js*'))])
    yield judge_mouse(bool(os.environ.get('DISPLAY')), bool(os.environ.get('WAYLAND_DISPLAY')),
                      importlib.util.find_spec('pynput') is not None)


def judge_pad(pads: Sequence[Tuple[str, bool]]) -> Line:
    """`pads`: (device, may this user read it?)."""
    closed = [device for device, readable in pads if not readable]
    if closed:
        return warning('Gamepad', '{} is plugged in, but cannot be read'.format(closed[0]),
                       'sudo usermod -aG input $USER, then log in again')
    if pads:
        return ok('Gamepad', '{} is plugged in'.format(pads[0][0]))
    return ok('Gamepad', 'none is plugged in (only the gamepad lab needs one; the panel has one)')


def judge_mouse(has_display: bool, is_wayland: bool, has_pynput: bool) -> Line:
    """Can mouse_client.py read the mouse of this session?"""
    if is_wayland:
        return warning('Mouse', 'the mouse cannot be read in a Wayland session',
                       'log in again with an "Xorg" (X11) session')
    if not has_display:
        return ok('Mouse', 'no screen here, so no mouse to drive by (the panel has a mouse pad)')
    if not has_pynput:
        return warning('Mouse', 'the mouse needs the Python package pynput',
                       'sudo apt install python3-pynput')
    return ok('Mouse', 'it can be read')


def look_at_disk() -> Line:
    """The line on the space for bags in the current folder."""
    try:
        folder = os.getcwd()
        return judge_disk(folder, shutil.disk_usage(folder).free, os.access(folder, os.W_OK))
    except OSError:
        return judge_disk('this folder, which is gone', 0.0, False)


def judge_disk(folder: str, free: float, writable: bool = True) -> Line:
    """`free`: space for bags in `folder` [bytes]."""
    gigabytes = '{:.1f} GB free in {}'.format(free / 1e9, folder)
    if not writable:
        return warning('Disk', '{} cannot be written: no bag can be recorded here'.format(folder),
                       'cd ~')
    if free < RECORDS_NO_MORE:
        return fault('Disk', gigabytes + ': rosbag records nothing below 1 GB',
                     'delete old bags, or record in another folder')
    if free < RECORDS_NOT_LONG:
        return warning('Disk', gigabytes + ': rosbag warns below 5 GB', 'delete old bags')
    return ok('Disk', gigabytes)
