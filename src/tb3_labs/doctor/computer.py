"""Judgements of this computer: its Python, its gamepad and mouse, its disk."""
from typing import Mapping, Sequence, Tuple

from tb3_labs.doctor.line import Line, fault, ok, warning

#: rosbag record stops with less space than the first of these, and warns below the second [bytes].
RECORDS_NO_MORE = 1e9
RECORDS_NOT_LONG = 5e9

SOURCE = 'source scripts/setup.sh in this terminal, then rosrun tb3_labs doctor.py'


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
