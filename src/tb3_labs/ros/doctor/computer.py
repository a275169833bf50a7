"""What this computer has: packages, gamepad, mouse, disk."""
import glob
import importlib
import importlib.util
import os
import shutil
import sys

from tb3_labs.doctor.computer import judge_disk, judge_mouse, judge_pad, judge_python

#: What the labs' nodes import.
PACKAGES = ('rospy', 'numpy', 'squaternion', 'geometry_msgs.msg', 'nav_msgs.msg',
            'sensor_msgs.msg', 'tf2_ros', 'tb3_labs.srv')


def look_at_python():
    """The line on the interpreter and its packages. Each is really imported: a package may be there
    and lack what it needs."""
    missing = {}
    for name in PACKAGES:
        try:
            importlib.import_module(name)
        except Exception as trouble:    # a broken package may raise anything
            missing[name.partition('.')[0] if name != 'tb3_labs.srv' else 'tb3_labs'] = (
                ' '.join(str(trouble).split()) or type(trouble).__name__)
    return judge_python('.'.join(map(str, sys.version_info[:3])), sys.executable, missing,
                        os.environ.get('ROS_VERSION', '1'))


def look_at_devices():
    """The lines on gamepad and mouse."""
    yield judge_pad([(path, os.access(path, os.R_OK))
                     for path in sorted(glob.glob('/dev/input/js*'))])
    yield judge_mouse(bool(os.environ.get('DISPLAY')), bool(os.environ.get('WAYLAND_DISPLAY')),
                      importlib.util.find_spec('pynput') is not None)


def look_at_disk():
    """The line on the space for bags in the folder that the person is in."""
    try:
        folder = os.getcwd()
        return judge_disk(folder, shutil.disk_usage(folder).free, os.access(folder, os.W_OK))
    except OSError:
        return judge_disk('this folder, which is gone', 0.0, False)
