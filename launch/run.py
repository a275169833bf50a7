"""Runs a program of tb3_labs.ros: python3 PATH/run.py NAME ARGUMENTS

`python3 -m` would look for each module in the current folder first, even for Python's own modules.
So a copy.py in this folder would run. A script looks first in the folder of the script.
"""
import runpy
import sys

MODULES = {'launch': 'launch_arguments'}    # students' launch files call the module `launch`
del sys.path[0], sys.argv[0]    # so that Python does not look for modules here either
module = MODULES.get(sys.argv[0], sys.argv[0])
runpy.run_module('tb3_labs.ros.' + module, run_name='__main__', alter_sys=True)
