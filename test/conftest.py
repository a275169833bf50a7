"""pytest alone runs the unit tests: those with real nodes run by rostest."""
collect_ignore = ['.run_test.py', 'ros', 'benchmark']
