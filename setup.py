# For catkin only (catkin_python_setup); do not run it by hand.
from setuptools import find_packages, setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=find_packages('src'), package_dir={'': 'src'},
    package_data={'tb3_labs.panel': ['page/*']}))    # HTML, style and JavaScript
