# For catkin only (catkin_python_setup); do not run it by hand.
from setuptools import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=['tb3_labs', 'tb3_labs.marking', 'tb3_labs.report', 'tb3_labs.ros', 'tb3_labs.ros.marking'],
    package_dir={'': 'src'},
))
