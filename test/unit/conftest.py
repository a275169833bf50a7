"""Property tests are repeatable: the same examples on every machine, none stored."""
import gc
import os
import sys

from hypothesis import given, settings
from hypothesis import strategies as st

# the roll-outs of test/benchmark have tests, too
sys.path.insert(0, os.path.join(os.path.dirname(__file__), os.pardir, 'benchmark'))

settings.register_profile('repeatable', derandomize=True, deadline=None, database=None,
                          max_examples=50)
settings.load_profile('repeatable')


def pytest_collection_finish():
    """What the test files hold stays to the end, so the garbage collector need not look through it
    again and again; for the tests that count objects that is most of their time."""
    wake_hypothesis()
    gc.collect()
    gc.freeze()


@given(st.none())
def wake_hypothesis(_nothing):
    """At its first run hypothesis asks the collector about the random generators; nothing is frozen
    then."""
