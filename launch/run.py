"""Runs a program of tb3_labs.ros: python3 PATH/run.py NAME ARGUMENTS

NAME is `dynparam`, `robot_description`, or `launch`, which checks the arguments of a launch file.

`python3 -m` looks for every module in the current folder first, also for modules of Python and ROS:
somebody's copy.py would run. A script looks in its own folder.
"""
import runpy
import sys

#: {name on the command line of launch files: name of the module, if it is another one}
MODULES = {'launch': 'launch_arguments'}

del sys.path[0], sys.argv[0]    # nothing in this folder is to be imported either
module = MODULES.get(sys.argv[0], sys.argv[0])
runpy.run_module('tb3_labs.ros.' + module, run_name='__main__', alter_sys=True)
