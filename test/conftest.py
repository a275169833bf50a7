"""pytest alone runs the unit tests: those with real nodes run by rostest."""
collect_ignore = ['ros', 'marking', 'benchmark', 'mutation']
