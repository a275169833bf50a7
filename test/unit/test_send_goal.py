"""An answer to a goal may arrive before send_goal() has returned."""
import runpy
from types import SimpleNamespace

import pytest

from actionlib import CommState
from actionlib_msgs.msg import GoalStatus

from pages import SCRIPTS
from tb3_labs.geometry.se2 import Pose2


@pytest.mark.parametrize('status, ends_with', [(GoalStatus.REJECTED, 1), (GoalStatus.SUCCEEDED, 0)])
def test_an_immediate_answer_ends_the_program(status, ends_with, monkeypatch, capsys):
    drive = runpy.run_path(str(SCRIPTS / 'send_goal.py'))['drive']
    client = SimpleNamespace(    # the goal is over at once
        wait_for_server=lambda _: True, get_comm_state=lambda: CommState.DONE,
        get_goal_status=lambda: status, get_goal_status_text=lambda: 'the text',
        send_goal=lambda goal, on_transition: on_transition(client) or client)
    monkeypatch.setattr('actionlib.ActionClient', lambda *_: client)
    monkeypatch.setitem(drive.__globals__, 'print_states', lambda: None)
    for name in ('init_node', 'on_shutdown'):
        monkeypatch.setattr('rospy.' + name, lambda *_, **__: None)
    monkeypatch.setitem(drive.__globals__, 'pause', None)    # nothing is waited for
    assert drive(Pose2(1.0, 0.0, 0.0)) == ends_with
    assert capsys.readouterr().out == 'the text\n'
