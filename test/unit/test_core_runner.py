"""The runner of a core: commands leave in the order of the decisions, even if other parts wait."""
import threading

from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.ros import core_runner
from tb3_labs.supervision.events import LogLine, Output

DRIVE, STOP = Twist2(0.1, 0.0), Twist2()


class RecordedCalls(list):
    """Takes the place of CmdVel, and of the Watchdog."""

    def send(self, command):
        self.append(command)

    def stop(self):
        self.append('a zero')

    def set_awake(self, awake):
        self.append(awake)

    def feed(self):
        """Nothing sleeps here."""

    close = list.clear


def test_what_waits_outside_holds_up_neither_a_drive_nor_a_stop(monkeypatch):
    record, told, go_on = RecordedCalls(), [], threading.Event()
    monkeypatch.setattr(core_runner, 'CmdVel', lambda: record)
    monkeypatch.setattr(core_runner, 'Watchdog', lambda *_: record)
    for level in ('info', 'warn'):
        monkeypatch.setattr(core_runner.rospy, 'log' + level, lambda form, text, level=level: go_on.wait(
            20.0) and told.append((form % text, level == 'warn')))
    outputs, lines = [], [LogLine('driving, 50 %', False), LogLine('stopped', True)]
    carried = threading.Event()

    def carry_out(output):
        assert not node._lock.locked()
        (carried.set if output.log_lines[0] is lines[1] else record.copy)()

    node = core_runner.CoreRunner(lambda: outputs.pop(0), record.append, carry_out)
    outputs += [Output(DRIVE, True, lines[:1], True), Output(STOP, log_lines=lines[1:]), Output()]
    all_of_them = list(outputs)
    node.handle(list)
    node.check()
    node.check()
    assert record == ['a zero', DRIVE, all_of_them[0], True, STOP, all_of_them[1], False,
                      all_of_them[2], False]
    assert told == []
    go_on.set()
    assert carried.wait(20.0) and told == lines
