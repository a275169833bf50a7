"""Runs a program of tb3_labs.ros. Usage: python3 PATH/run.py NAME ARGUMENTS

With `python3 -m`, Python looks for each module in the current folder first. A file copy.py in the
current folder would run in place of Python's own module `copy`.
"""
import runpy
import sys

MODULES = {'launch': 'launch_arguments'}    # {name in students' launch files: module}
del sys.path[0]     # Python must not look for modules in this script's folder
del sys.argv[0]
module = MODULES.get(sys.argv[0], sys.argv[0])
runpy.run_module('tb3_labs.ros.' + module, run_name='__main__', alter_sys=True)
