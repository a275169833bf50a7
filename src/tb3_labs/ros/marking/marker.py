"""Judges one submission by its lab's check_LAB.test, in a world of its own.

A master, an embedded robot, a home and a log folder of its own; a time limit; and at the end not a
process is left, whatever the submission did.
"""
import os
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from pathlib import Path

import rospkg

from tb3_labs.marking.criteria import judge
from tb3_labs.marking.labs import LABS
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import Observation
from tb3_labs.ros.marking.submission import Unusable, prepare

#: Every process of a submission has this in its environment, with a value of its own.
COOKIE = 'TB3_LABS_SUBMISSION'
#: Of the caller's environment, what would change the result.
FORGOTTEN = ('ROS_MASTER_URI', 'ROS_IP', 'ROS_NAMESPACE', 'TURTLEBOT3_MODEL', 'ROSCONSOLE_FORMAT',
             'DISPLAY', 'WAYLAND_DISPLAY')
#: The master alone: rosout would write down what a node floods it with.
ROSCORE = '<launch/>'
#: To the terminal as usual, but to no file.
LOGGING = '''[loggers]
keys=root,rosout
[handlers]
keys=stream
[formatters]
keys=plain
[logger_root]
level=INFO
handlers=
[logger_rosout]
level=INFO
handlers=stream
propagate=0
qualname=rosout
[handler_stream]
class=rosgraph.roslogging.RosStreamHandler
level=DEBUG
formatter=plain
args=(True,)
[formatter_plain]
format=[%(name)s][%(levelname)s] %(asctime)s: %(message)s
'''


def points_file():
    """This package's file with what each criterion is worth."""
    return Path(rospkg.RosPack().get_path('tb3_labs')) / 'test' / 'marking' / 'points.yaml'


class Interrupted(RuntimeError):
    """Somebody wants no more marks."""


#: A robot that was held up for longer than this was not judged fairly, nor was its node [s].
HELD_UP = 0.15


class Marker:
    """Marks submissions of one lab; several at a time, by threads, if wanted."""

    def __init__(self, lab, worth, logs, parts=(), names=(), limit=300.0,
                 network='quiet'):
        """`worth`: criterion -> points; `logs`: an existing folder; `names`: of the node's file,
        if they are not the lab's; `limit`: time for one submission [s]; `network`: one of
        tb3_labs.simulation.network.NETWORKS, between robot and node."""
        self._lab, self._worth, self._logs = lab, worth, Path(logs)
        self._parts, self._names, self._limit = parts, names or LABS[lab].files, limit
        self._network = network
        self._interrupted = False
        self._cookies = set()

    def interrupt(self):
        """Kill what is under way: each :meth:`mark` raises Interrupted from now on."""
        self._interrupted = True
        for cookie in list(self._cookies):
            sweep(cookie)

    def mark(self, folder):
        """The Marks of the submission in `folder`.

        Where the machine was too busy to judge it fairly it is tried once more."""
        marks = self._try(Path(folder))
        if self._held_up(marks):
            marks = self._try(Path(folder))
            if self._held_up(marks):
                marks.remarks.append('The machine held the robot up for {:.2f} s: what was seen '
                                     'may be unfair.'.format(marks.observation.longest_gap))
        return marks

    @staticmethod
    def _held_up(marks):
        return marks.observation is not None and marks.observation.longest_gap > HELD_UP

    def _try(self, folder):
        marks = Marks(folder.name)
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            cookie = uuid.uuid4().hex
            self._cookies.add(cookie)
            try:
                self._observe(marks, folder, Path(work), cookie)
            except Unusable as reason:
                marks.remarks.append(str(reason))
            finally:
                sweep(cookie)
                self._cookies.remove(cookie)
        observation = marks.observation or Observation(self._lab, marks.node)
        marks.verdicts = judge(LABS[self._lab].criteria, observation, self._worth, self._parts)
        return marks

    def _observe(self, marks, folder, work, cookie):
        log = self._logs / (folder.name + '.log')
        prepared = prepare(folder, self._names, work / 'ws',
                           self._logs / (folder.name + '.build.log'), {COOKIE: cookie})
        marks.node = '{}/{}'.format(prepared.package, prepared.executable)
        marks.remarks += prepared.remarks
        if self._network != 'quiet':
            marks.remarks.append('Judged over the network "{}".'.format(self._network))
        record = work / 'observation.json'
        self._go_on()
        with open(str(log), 'w') as file:
            check = subprocess.Popen(
                ['rostest', 'tb3_labs', 'check_{}.test'.format(self._lab),
                 'pkg:=' + prepared.package, 'type:=' + prepared.executable,
                 'parts:=' + ','.join(self._parts), 'record:={}'.format(record),
                 'network:=' + self._network],
                env=self._environment(prepared.environment, work), cwd=str(work),
                stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True)
            deadline = time.monotonic() + self._limit
            while check.poll() is None and not self._interrupted:
                if time.monotonic() > deadline:
                    marks.remarks.append('It was stopped after {:g} s.'.format(self._limit))
                    break
                time.sleep(0.1)
            sweep(cookie)
            check.wait()
        self._go_on()
        if not record.exists():
            marks.failed = True
            marks.remarks.append('It could not be judged: see {}.'.format(log))
            return
        marks.observation = Observation.from_json(record.read_text())
        shutil.copy(str(record), str(self._logs / (folder.name + '.json')))

    def _go_on(self):
        if self._interrupted:
            raise Interrupted('interrupted')

    @staticmethod
    def _environment(environment, work):
        settings = work / 'etc'
        settings.mkdir()
        (settings / 'roscore.xml').write_text(ROSCORE)
        (settings / 'logging.conf').write_text(LOGGING)
        given = {name: value for name, value in environment.items() if name not in FORGOTTEN}
        return dict(given, ROS_HOSTNAME='localhost', ROS_HOME=str(work / 'ros'),
                    ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                    ROS_PYTHON_LOG_CONFIG_FILE=str(settings / 'logging.conf'),
                    ROS_TEST_RESULTS_DIR=str(work / 'results'))


def sweep(cookie):
    """Kill every process that has this cookie in its environment, until there is none."""
    mark = '{}={}'.format(COOKIE, cookie).encode()
    while True:
        found = [number for number in os.listdir('/proc') if number.isdigit()
                 and mark in _environment_of(number)]
        if not found:
            return
        for number in found:
            try:
                os.kill(int(number), signal.SIGKILL)
            except ProcessLookupError:
                pass    # it has ended already


def _environment_of(number):
    try:
        with open('/proc/{}/environ'.format(number), 'rb') as file:
            return file.read().split(b'\0')
    except OSError:
        return ()
