"""Random messages in random order and time; see fuzzing.py, which also runs a million of them."""
import math

import pytest

import fuzzing
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.nodes.controller import ControllerCore
from tb3_labs.nodes.move_to_goal import MoveToGoalCore


@pytest.mark.parametrize('seed', range(4))
def test_no_message_makes_a_wild_command(seed):
    commands, refused = fuzzing.run(5000, seed)
    assert commands > 100 and refused > 100      # there were drives, and invalid messages


@pytest.mark.parametrize('owner, command, unasked', [
    (MoveToGoalCore, Twist2(math.nan, 0.0), False), (MoveToGoalCore, Twist2(0.0, 1.6), False),
    (ControllerCore, Twist2(0.1, 0.0), False), (MoveToGoalCore, Twist2(0.1, 0.0), True)])
def test_it_would_be_seen(monkeypatch, owner, command, unasked):
    sound = owner.command
    monkeypatch.setattr(
        owner, 'command', lambda self, now: (unasked or sound(self, now)) and command)
    with pytest.raises(AssertionError, match='without permission' if unasked else ''):
        fuzzing.run(20000, 1)
