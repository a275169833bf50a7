"""Property tests are repeatable: the same examples on every machine, none stored."""
import os
import sys

from hypothesis import settings

# the roll-outs of test/benchmark have tests, too
sys.path.insert(0, os.path.join(os.path.dirname(__file__), os.pardir, 'benchmark'))

settings.register_profile('repeatable', derandomize=True, deadline=None, database=None,
                          max_examples=50)
settings.load_profile('repeatable')
