"""The variables of real Python processes, as scripts/watch.py shows them: each node is its own process,
with a small rospy beside it whose spin() prints what the probe published, and goes on."""
import json
import os
import pty
import runpy
import shutil
import signal
import subprocess
import sys

import pytest

from pages import ROOT
from tb3_labs.watch import with_probe

WATCH = [sys.executable, str(ROOT / 'scripts' / 'watch.py')]
PROBE = str(ROOT / 'src' / 'tb3_labs' / 'watch' / 'probe')
FAKE = {
    'rospy/core.py': '''
import threading
started, heard, shown = [], threading.Event(), {}
def is_initialized(): return bool(started)
''',
    'rospy/__init__.py': '''
import json
from . import core
class Time:
    now = staticmethod(int)
class Publisher:
    def __init__(self, *args, **settings): pass
    def get_num_connections(self): return 1
    def publish(self, message):
        core.shown.clear()
        core.shown.update((each.key, each.value) for each in message.status[0].values)
        json.dumps(core.shown, ensure_ascii=False).encode('utf-8')
        core.heard.set()
def init_node(name): core.started.append(name)
def get_name(): return '/node'
def is_shutdown(): return False
def spin():
    for _ in range(2):      # the first reading may have begun before
        core.heard.clear()
        if not core.heard.wait(20): raise SystemExit('nothing was published')
    print(json.dumps(core.shown), flush=True)
''',
    'diagnostic_msgs/__init__.py': '',
    'diagnostic_msgs/msg.py': '''
class DiagnosticArray:
    class header: stamp = None
    def __init__(self, status): self.status = status
class DiagnosticStatus:
    def __init__(self, name): self.name, self.values = name, []
class KeyValue:
    def __init__(self, key, value): self.key, self.value = key, value
'''}


@pytest.fixture
def start(tmp_path, monkeypatch):
    """``start(text, **options)`` starts a node with this text, watched, and returns its process."""
    for name, text in FAKE.items():
        path = tmp_path / 'ros' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(
        [str(tmp_path / 'ros'), str(ROOT / 'src'), *filter(None, [os.environ.get('PYTHONPATH')])]))
    processes = []

    def started(text, command=(sys.executable,), **options):
        (tmp_path / 'node.py').write_text('import rospy\n' + text)
        processes.append(subprocess.Popen(
            [*WATCH, *command, str(tmp_path / 'node.py')], stdout=subprocess.PIPE,
            universal_newlines=True, **options))
        return processes[-1]
    yield started
    for process in processes:
        process.kill()
        process.communicate()


def shown(process):
    """What a node printed: the last line as JSON."""
    output, _ = process.communicate(timeout=60)
    return json.loads(output.splitlines()[-1])


START = "rospy.init_node('n')\n"
CASES = {
    'simple attributes, and globals, but not modules, functions and classes': ('''
import math
class Controller:
    K_HDG, goal_yaw = 0.1, 7
    def __init__(self):
        self.curr_yaw, self.turning, self.state, self.goal = 359.5, False, 'TURN', None
        self.callback = print
node, goals = Controller(), [1, 2.5, True]
def convert(): pass''', {'curr_yaw': '359.5', 'turning': 'False', 'state': 'TURN', 'goal': 'None', 'K_HDG': '0.1',
                         'goal_yaw': '7'},
        {'goals', 'callback', 'node', 'math', 'convert', 'rospy', '__name__'}),
    'an object that no name holds': ('''
class Controller:
    def __init__(self): self.curr_yaw = 1; callbacks.append(self.callback)
    def callback(self): pass
callbacks = []
Controller()''', {'curr_yaw': '1'}, {'callbacks'}),
    'numpy, a dataclass, an Enum': ('''
from dataclasses import dataclass
from enum import Enum
import numpy as np
class State(Enum): TURN = 1
@dataclass
class Pose: x: float = 1.0
class Node:
    def __init__(self):
        self.pose, self.state = Pose(), State.TURN
        self.image, self.yaw, self.is_near = np.zeros((480, 640)), np.float64(0.25), np.bool_(True)
node = Node()''', {'pose.x': '1.0', 'state': 'TURN', 'yaw': '0.25', 'is_near': 'True'}, {'x', 'image'}),
    'an object with slots hides no other one': ('''
class Point:
    __slots__ = 'x'
class Node:
    def __init__(self): self.yaw, self.point = 2, Point()
node = Node()''', {'yaw': '2'}, {'x'}),
    'a property and __getattr__ that raise are not called': ('''
class Node:
    def __init__(self): self.yaw = 2
    @property
    def goal(self): print('called'); raise SystemExit
    def __getattr__(self, name): print('called', name); raise SystemExit
    def __getattribute__(self, name): print('called', name); raise SystemExit
node = object.__new__(Node)
object.__setattr__(node, 'yaw', 2)''', {'yaw': '2'}, {'goal'}),
    'private names, a base class': ('''
class Base:
    RATE = 10
    def __init__(self): self.__yaw = 1
class _Node(Base):
    def __init__(self): super().__init__(); self.__goal, self._x = 2, 3
node = _Node()''', {'_Base__yaw': '1', '__goal': '2', '_x': '3', 'RATE': '10'}, set()),
    'values that cannot be sent hide no other one': ('''
class Odd(type):
    __module__ = property(lambda self: 1 / 0)
class Strange(metaclass=Odd):
    __module__ = property(lambda self: 1 / 0)
class Node:
    def __init__(self):
        self.__dict__[3], self.huge, self.odd, self.letters = 4, 10 ** 6000, '\\ud800', 'x' * 500
        self.me, self.error, self.strange, self.yaw = self, ValueError('no'), Strange(), 1
node = Node()''', {'yaw': '1', 'odd': '?', 'letters': 'x' * 200}, {'huge', '3', 'error'}),
    'the node beside many small objects': ('''
class Node:
    def __init__(self): self.yaw, self.cloud = 1, [Particle(k) for k in range(100)]
class Particle:
    def __init__(self, k): self.k = k
node = Node()''', {'yaw': '1'}, set()),
    'no more than forty': ('''
class Node:
    def __init__(self): vars(self).update(('a%d' % k, k) for k in range(100))
node = Node()''', {'a%d' % k: str(k) for k in range(40)}, {'a40'}),
}


@pytest.mark.parametrize('case', CASES)
def test_the_variables_of_a_node_are_shown(case, start):
    text, expected, hidden = CASES[case]
    found = shown(start(text.lstrip() + '\n' + START + 'rospy.spin()\n'))
    assert {name: found.get(name) for name in expected} == expected
    assert not hidden & set(found) and len(found) <= 40, found


def test_the_variables_of_a_running_function_are_shown_as_they_change(start):
    process = start('''
def main():
    yaw = 1
    def callback():
        nonlocal yaw
        yaw += 1
    rospy.init_node('n')
    for _ in range(2):
        rospy.spin()
        callback()
if __name__ == '__main__':
    main()
''')
    output, _ = process.communicate(timeout=60)
    assert [json.loads(line)['yaw'] for line in output.splitlines()] == ['1', '2']


def test_a_relay_of_catkin_and_a_module_beside_the_script(start, tmp_path):
    (tmp_path / 'helper.py').write_text('class Helper:\n    def __init__(self): self.error = 5\n')
    (tmp_path / 'relay.py').write_text('''
import sys
script = {!r}
sys.path.insert(0, {!r})
with open(script, 'r') as fh:
    context = {{'__builtins__': __builtins__, '__doc__': None, '__file__': script, '__name__': __name__,
               '__package__': __package__}}
    exec(compile(fh.read(), script, 'exec'), context)
'''.format(str(tmp_path / 'node.py'), str(tmp_path)))
    found = shown(start('''
from helper import Helper
class Node:
    def __init__(self): self.helper, self.yaw = Helper(), 3
node, gain = Node(), 0.5
''' + START + 'rospy.spin()', [sys.executable, str(tmp_path / 'relay.py')]))
    assert found == {'yaw': '3', 'helper.error': '5', 'gain': '0.5'}


def test_the_probe_shows_nothing_of_its_own_in_a_node_of_its_package(start, tmp_path, monkeypatch):
    probe = shutil.copytree(PROBE, str(tmp_path / 'package' / 'probe'))
    node = tmp_path / 'package' / 'node.py'
    node.with_name('package.xml').write_text('')
    node.with_name('sitecustomize.py').write_text('')      # as a workspace within the package has one
    monkeypatch.setenv('PYTHONPATH', str(node.parent) + os.pathsep + os.environ['PYTHONPATH'])
    node.write_text('import rospy\nyaw = 1\n' + START + 'rospy.spin()')
    output = subprocess.check_output(
        [sys.executable, str(node)],
        env=with_probe(os.environ, probe), universal_newlines=True, timeout=60)
    assert json.loads(output) == {'yaw': '1'}


def test_an_object_that_the_node_drops_is_not_kept(start):
    process = start('''
import sys
class Node:
    def __init__(self): self.yaw = 1
    def __del__(self): print('dropped', flush=True)
node = Node()
''' + START + '''
rospy.spin()
del node
rospy.spin()
print('end', flush=True)
''')
    lines = process.communicate(timeout=60)[0].splitlines()
    assert lines[1] == 'dropped' and lines[-1] == 'end'
    assert json.loads(lines[0]) == {'yaw': '1'} and json.loads(lines[2]) == {}


def test_the_node_has_the_path_of_its_usual_start_and_the_systems_own_module(start, tmp_path):
    (tmp_path / 'ros' / 'sitecustomize.py').write_text("print('the own one')\n")
    process = start('''
import json, os, sys
import sitecustomize
print(json.dumps([os.environ['PYTHONPATH'], sys.path, sitecustomize.__file__]))
''')
    output = process.communicate(timeout=60)[0].splitlines()
    path, folders, module = json.loads(output[-1])
    assert output[0] == 'the own one' and module == str(tmp_path / 'ros' / 'sitecustomize.py')
    assert path == os.environ['PYTHONPATH'] and PROBE not in folders


def test_a_node_without_a_path_has_none(start, tmp_path, monkeypatch):
    program = "import os, sys; print('PYTHONPATH' in os.environ, {!r} in sys.path)".format(PROBE)
    environment = {name: value for name, value in os.environ.items() if name != 'PYTHONPATH'}
    environment['PYTHONPATH'] = PROBE
    output = subprocess.check_output([sys.executable, '-c', program], env=environment)
    assert output.split() == [b'False', b'False']


@pytest.mark.parametrize('end, status', [
    ('raise SystemExit(3)', 3), ('raise ValueError', 1), ('import os; os._exit(5)', 5),
    ('import os, signal; os.kill(os.getpid(), signal.SIGTERM)', -signal.SIGTERM)])
def test_the_exit_status_is_the_nodes_own(end, status, start):
    process = start(START + 'rospy.spin()\n' + end, stderr=subprocess.DEVNULL)
    process.communicate(timeout=60)
    assert process.returncode == status


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_reaches_the_nodes_own_handler_in_its_main_thread(number, start):
    process = start('''
import os, signal, threading
def on_signal(number, frame):
    # print is not reentrant
    os.write(1, '{} {}'.format(number, threading.current_thread() is threading.main_thread()).encode())
    raise SystemExit(7)
''' + 'signal.signal({}, on_signal)\n'.format(int(number)) + START + '''rospy.spin()
while True:     # signal.pause() would miss a signal that comes just before it
    threading.Event().wait(0.1)
''')
    process.stdout.readline()
    process.send_signal(number)
    assert process.communicate(timeout=60)[0].split() == [str(int(number)), 'True']
    assert process.returncode == 7


def test_the_process_and_its_terminal_are_the_nodes_own(start):
    ours, theirs = pty.openpty()
    process = start('import os, sys\n' + START + '''rospy.spin()
print(os.getpid(), sys.stdin.isatty(), input())''', stdin=theirs)
    os.write(ours, b'l\n')
    assert process.communicate(timeout=60)[0].split()[-3:] == [str(process.pid), 'True', 'l']


@pytest.mark.parametrize('arguments, status, said', [
    ([], 2, 'rosrun tb3_labs watch.py'), (['--help'], 0, 'rosrun tb3_labs watch.py'),
    (['/no/such/node.py'], 127, '/no/such/node.py cannot be started')])
def test_a_wrong_command_is_explained(arguments, status, said, capsys):
    assert runpy.run_path(str(ROOT / 'scripts' / 'watch.py'))['main'](arguments) == status
    printed, problem = capsys.readouterr()
    assert said in (problem if status else printed)
