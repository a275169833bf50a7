"""The runner of a core sends commands in the order of the decisions, even if other parts wait."""
import threading
from types import SimpleNamespace

import pytest

from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.ros import cmd_vel, core_runner
from tb3_labs.supervision.events import LogLine, Output

DRIVE, STOP = Twist2(0.1, 0.0), Twist2()


class RecordedCalls(list):
    """Takes the place of CmdVel, and of the Watchdog."""

    def stop(self):
        self.append('a zero')

    def on_message_handled(self):
        """The Watchdog has no thread here."""

    send = set_awake = list.append
    close = list.clear


def test_a_blocked_log_delays_neither_a_drive_nor_a_stop(monkeypatch):
    record, logged, go_on, carried = RecordedCalls(), [], threading.Event(), threading.Event()
    monkeypatch.setattr(core_runner, 'CmdVel', lambda: record)
    monkeypatch.setattr(core_runner, 'Watchdog', lambda *_: record)
    for level in ('info', 'warn'):
        monkeypatch.setattr(core_runner.rospy, 'log' + level, lambda form, text, level=level: go_on.wait(
            20.0) and logged.append((form % text, level == 'warn')))
    lines = [LogLine('driving, 50 %', False), LogLine('stopped', True)]
    outputs = [Output(DRIVE, True, lines[:1], True), Output(STOP, log_lines=lines[1:]), Output()]
    waiting = list(outputs)

    def carry_out(output):
        assert not runner._lock.locked()
        if output is outputs[1]:
            carried.set()

    runner = core_runner.CoreRunner(lambda: waiting.pop(0), record.append, carry_out)
    runner.call_and_decide(list)
    runner.decide()
    runner.decide()
    assert record == ['a zero', DRIVE, outputs[0], True, STOP, outputs[1], False, outputs[2], False]
    assert logged == []
    go_on.set()
    assert carried.wait(20.0) and logged == lines


@pytest.mark.parametrize('command, sent', [
    ((0.2, 1e-40), (0.2, 0.0)), ((-1e-300, -2.0), (0.0, -2.0)), ((2e-4, -2e-4), (2e-4, -2e-4)),
    ((1e-40, -1e-40), None)])
def test_a_speed_that_turns_no_motor_is_sent_as_zero(monkeypatch, command, sent):
    published = []
    monkeypatch.setattr(cmd_vel.rospy, 'Publisher',
                        lambda *_, **__: SimpleNamespace(publish=lambda twist: published.append(
                            (twist.linear.x, twist.angular.z))))
    monkeypatch.setattr(cmd_vel, 'make_writes_immediate', lambda publisher: None)
    cmd_vel.CmdVel().send(Twist2(*command))
    assert published == ([sent] if sent else [])
