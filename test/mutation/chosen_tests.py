"""A pytest plugin: it finds the tests that run each piece of code, or runs only given tests.

MUTATION_SEEN=FILE     writes, as JSON, of each test that passed: its name, the seconds of computing
                       it took, and the marks that the code set; by the name '', those of imports
MUTATION_TESTS=FILE    runs only the tests of that JSON list of [name, seconds], in its order; ends
                       the process with status `HANG` where one computes for much longer than that

What a fixture of a module or a session runs counts for every test that uses it.
The marks are strings in a set, builtins._mutation_marks: a place that every module can reach.
"""
import builtins
import json
import os
import resource
import signal
import time
from typing import Dict, Set

import pytest

#: Exit status of a process in which something ran for too long.
HANG = 86
#: Allowed to a test: this many times what it took, and this on top [s of computing].
TIMES, ON_TOP = 5.0, 3.0
#: Allowed until the first test begins [s of computing].
START = 30.0
#: Memory allowed to the process [bytes]: a loop that collects without end stops, too.
MEMORY = 8 * 2 ** 30

SEEN, CHOSEN = os.environ.get('MUTATION_SEEN'), os.environ.get('MUTATION_TESTS')
MARKS: Set[str] = builtins.__dict__.setdefault('_mutation_marks', set())

_tests: Dict[str, list] = {}
_of_fixture: Dict[str, Set[str]] = {}


def _give_up(_signal, _frame):
    os._exit(HANG)


if CHOSEN:
    with open(CHOSEN) as chosen:
        _seconds = dict(json.load(chosen))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, _give_up)
    signal.setitimer(signal.ITIMER_PROF, START)


def pytest_collection_modifyitems(items):
    """Keep the tests that are asked for."""
    if CHOSEN:
        rank = {name: number for number, name in enumerate(_seconds)}
        items[:] = sorted((item for item in items if item.nodeid in rank),
                          key=lambda item: rank[item.nodeid])


def pytest_collection_finish():
    """All is imported: code that ran until now is noted by the name ''."""
    if SEEN:
        _tests[''] = [0.0, sorted(MARKS)]
        MARKS.clear()


def pytest_runtest_setup(item):
    """A test begins: its time, and that of its fixtures, is limited."""
    if CHOSEN:
        signal.setitimer(signal.ITIMER_PROF, TIMES * _seconds[item.nodeid] + ON_TOP)


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef):
    """Separate the code that a shared fixture runs."""
    if not SEEN or fixturedef.scope == 'function':
        yield
        return
    outer = set(MARKS)
    MARKS.clear()
    yield
    _of_fixture.setdefault(fixturedef.argname, set()).update(MARKS)
    MARKS.update(outer)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item):
    """Note the code that a test runs."""
    if not SEEN:
        yield
        return
    begun = time.process_time()
    outcome = yield
    marks = set(MARKS)
    MARKS.clear()
    for name in item.fixturenames:
        marks |= _of_fixture.get(name, set())
    if outcome.excinfo is None:
        _tests[item.nodeid] = [time.process_time() - begun, sorted(marks)]


def pytest_sessionfinish():
    """Write the notes."""
    if SEEN:
        with open(SEEN, 'w') as file:
            json.dump(_tests, file)
