"""The signals of a node, sent to a process of its own."""
import os
import pathlib
import re
import signal
import subprocess
import sys

import pytest

pytest.importorskip('rospy')    # the processes below need it

BEGIN = '''
import os, signal, threading, time
from tb3_labs.ros.node import Interrupted, Signals, when_stopped
lock = threading.Lock()

def say(word):    # not print: a signal's handler that prints while another print runs is an error
    os.write(1, (word + '\\n').encode())

def before():
    with lock:
        say('before')

when_stopped(before, lambda: say('after'))
signals = Signals()
signals.take_ctrl_z()
'''
WAIT = '''
try:
    say('ready')
    signals.wait()
    say('woken')
except Interrupted:
    say('interrupted')
'''


class Process(subprocess.Popen):
    """A process that runs `code`, and has printed 'ready'."""

    def __init__(self, code, before_it=None):
        super().__init__([sys.executable, '-c', BEGIN + code], stdout=subprocess.PIPE, text=True,
                         preexec_fn=before_it)
        assert self.line() == 'ready'

    def line(self):
        return self.stdout.readline().strip()

    def rest(self):
        """The rest of its output, up to its end within 10 s."""
        try:
            text, _ = self.communicate(timeout=10.0)
        finally:
            self.kill()
        assert self.returncode == 0
        return text.split()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, None])
def test_a_signal_or_its_time_ends_a_wait(number):
    process = Process(WAIT if number else WAIT.replace('wait()', 'wait(0.1)'))
    if number:
        process.send_signal(number)
    assert process.rest() == ['interrupted' if number else 'woken']


def test_nohup_is_respected_and_another_thread_ends_the_wait():
    process = Process('threading.Timer(1.0, signals.wake).start()' + WAIT,
                      lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    process.send_signal(signal.SIGHUP)
    assert process.rest() == ['woken']


@pytest.mark.parametrize('wait', [WAIT, WAIT.replace('wait()', 'wait(60.0)')])
def test_a_signal_that_a_library_swallows_ends_the_wait_all_the_same(wait):
    process = Process('''
try:
    say('ready')
    time.sleep(10.0)
except:
    say('swallowed')
''' + wait)
    process.send_signal(signal.SIGINT)
    assert process.rest() == ['swallowed', 'ready', 'interrupted']


def test_ctrl_z_comes_after_what_stops_the_robot():
    process = Process(WAIT)
    process.send_signal(signal.SIGTSTP)
    assert process.line() == 'before'
    _, status = os.waitpid(process.pid, os.WUNTRACED)
    assert os.WIFSTOPPED(status)
    process.send_signal(signal.SIGCONT)
    assert process.line() == 'after'
    process.send_signal(signal.SIGINT)
    assert process.rest() == ['interrupted']


def test_ctrl_z_does_not_hold_up_an_end_that_has_begun():
    # as the hooks of a shutdown, which run in the main thread and hold the node's locks
    process = Process(WAIT + '''
with lock:
    os.kill(os.getpid(), signal.SIGTSTP)
    time.sleep(0.1)
say('ended')
''')
    process.send_signal(signal.SIGINT)
    assert process.rest() == ['interrupted', 'ended']


# ----- Ctrl+C while a node imports its modules

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / 'scripts'
RUNS = re.compile(r'^from tb3_labs\.ros\.node import .*\brun\b', re.MULTILINE)
NODES = sorted(path.name for path in SCRIPTS.glob('*.py') if RUNS.search(path.read_text()))


@pytest.mark.parametrize('name', NODES)
def test_ctrl_c_ends_a_node_that_still_imports(name):
    node = subprocess.Popen([sys.executable, '-X', 'importtime', str(SCRIPTS / name)],
                            stderr=subprocess.PIPE, text=True,
                            env=dict(os.environ, ROS_MASTER_URI='http://localhost:1'))
    try:
        for line in node.stderr:
            if 'rospy.' in line:
                break
        node.send_signal(signal.SIGINT)
        assert node.wait(10.0) == -signal.SIGINT and 'Traceback' not in node.stderr.read()
    finally:
        node.kill()
        node.wait()
        node.stderr.close()
