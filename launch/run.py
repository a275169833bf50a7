"""Runs a program of tb3_labs.ros: python3 PATH/run.py NAME ARGUMENTS

`python3 -m` looks for every module in the current folder first, also for modules of Python and ROS:
somebody's copy.py would run. A script looks in its own folder.
"""
import runpy
import sys

MODULES = {'launch': 'launch_arguments'}    # launch files of students use the name `launch`
del sys.path[0], sys.argv[0]    # nothing in this folder is to be imported either
module = MODULES.get(sys.argv[0], sys.argv[0])
runpy.run_module('tb3_labs.ros.' + module, run_name='__main__', alter_sys=True)
