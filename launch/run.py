"""Runs a program of tb3_labs.ros. Usage: python3 PATH/run.py NAME ARGUMENTS

This program replaces `python3 -m tb3_labs.ros.NAME`, which looks for each module in the current
folder first. There, a student's file copy.py would run in place of Python's own module `copy`.
"""
import runpy
import sys

MODULE_OF_NAME = {'launch': 'launch_arguments'}    # {NAME in students' launch files: module}
module = MODULE_OF_NAME.get(sys.argv[1], sys.argv[1])
del sys.argv[0]     # the module reads ARGUMENTS from sys.argv[1:]
del sys.path[0]     # Python must not look for modules in this script's folder
runpy.run_module('tb3_labs.ros.' + module, run_name='__main__', alter_sys=True)
