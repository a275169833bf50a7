"""Stories of stops and givings in the core, judged by the ledger; ten thousand: ledger.py itself."""
import pytest

import ledger
from tb3_labs.nodes import gamepad, pad
from tb3_labs.supervision import permission


@pytest.mark.parametrize('part', range(6))
def test_nobody_drives_without_a_persons_leave(part):
    results = [ledger.check(seed) for seed in range(25 * part, 25 * (part + 1))]
    assert [(seed, wrong[0]) for seed, wrong, _ in results if wrong] == []
    assert sum(driven for _, _, driven in results) > 500      # otherwise nothing was judged


def a_story_goes_wrong():
    return any(ledger.check(seed)[1] for seed in range(60))


@pytest.mark.parametrize('of, name, value', [
    (permission, 'LAPSE', 5.0), (permission, 'LONGEST_LAPSE', 60.0),
    (pad, 'PAD_TIMEOUT', 9.0)])
def test_it_would_be_seen_if_a_limit_were_missed(monkeypatch, of, name, value):
    monkeypatch.setattr(of, name, value)
    assert a_story_goes_wrong()


def test_it_would_be_seen_if_a_repetition_gave_control(monkeypatch):
    told = permission.Permission.told

    def forgetful(self, granted, now, *details):
        self._said.clear()
        told(self, granted, now, *details)
    monkeypatch.setattr(permission.Permission, 'told', forgetful)
    assert a_story_goes_wrong()


def test_it_would_be_seen_if_a_pushed_stick_drove_at_once(monkeypatch):
    monkeypatch.setattr(gamepad.GamepadCore, '_is_ready', lambda self, message: True)
    assert a_story_goes_wrong()
