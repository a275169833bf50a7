# For catkin only (catkin_python_setup); do not run it by hand.
from setuptools import find_packages, setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=find_packages('src'), package_dir={'': 'src'},
    # HTML, style and JavaScript
    package_data={'tb3_labs.drawing': ['*.js', '*.css'], 'tb3_labs.panel': ['page/*'],
                  'tb3_labs.report.page': ['*.css', '*.html', '*.js'],
                  'tb3_labs.watch': ['probe/*.py']}))
