#!/usr/bin/env python3
"""Runs the file of a rostest: <test type=".run_test.py" args="test/ros/turn_test.py" .../>

It alone is a program of the package, and hidden: the completion of rosrun lists programs for users.
It is relayed as the nodes are, so the tests run with the workspace's Python.
"""
import os
import runpy
import sys

import rospkg

if __name__ == '__main__':
    PATH = os.path.join(rospkg.RosPack().get_path('tb3_labs'), sys.argv.pop(1))
    FOLDER, FILE = os.path.split(PATH)
    sys.path.insert(0, FOLDER)
    if FILE.endswith('_test.py'):
        from rosunit_internals import run
        run(FILE[:-len('_test.py')])
    else:
        runpy.run_path(PATH, run_name='__main__')
