"""A node's printing: in order, without waits, and with the number of dropped lines; its waiting."""
import threading
import time

import pytest

pytest.importorskip('rospy')

from tb3_labs.news import News    # noqa: E402
from tb3_labs.ros import console    # noqa: E402
from tb3_labs.ros.clocks import wait_until    # noqa: E402


@pytest.fixture
def printer(monkeypatch):
    """A console of three lines, as that of a node."""
    monkeypatch.setattr(console, 'CAPACITY', 3)
    monkeypatch.setattr(console, '_console', None)
    console.start()
    return console._console


def test_before_the_start_text_is_printed_at_once(capsys, monkeypatch):
    monkeypatch.setattr(console, '_console', None)
    console.say('early')
    assert capsys.readouterr().out == 'early\n'
    assert console.flush()


def test_a_terminal_that_takes_nothing_holds_up_nobody(printer, capsys, monkeypatch):
    monkeypatch.setattr(console, 'LAST_WAIT', 0.1)
    began, goes_on = threading.Event(), threading.Event()
    printer.put(lambda: (began.set(), goes_on.wait(10.0)))
    assert began.wait(5.0)
    for number in range(7):           # three of them wait, the others are dropped
        console.say(str(number))
    assert not console.flush()
    monkeypatch.setattr(console, 'LAST_WAIT', 5.0)
    goes_on.set()
    assert console.flush()
    assert capsys.readouterr().out.split('\n') == ['0', '1', '2', (
        '... 4 lines were dropped here: the terminal did not take them'), '']


def test_a_terminal_that_has_gone_ends_nothing(printer, capsys):
    def fail():
        raise OSError('gone')
    printer.put(fail)
    console.say('next')
    assert console.flush()
    assert capsys.readouterr().out == 'next\n'


def test_news_are_logged_warnings_as_such(monkeypatch):
    logged = []
    monkeypatch.setattr(console.rospy, 'loginfo', lambda *words: logged.append(('info',) + words))
    monkeypatch.setattr(console.rospy, 'logwarn', lambda *words: logged.append(('warn',) + words))
    console.log_news([News('50 % done', warning=False), News('lost', warning=True)])
    assert logged == [('info', '%s', '50 % done'), ('warn', '%s', 'lost')]


def test_it_waits_until_the_condition_holds_or_gives_up_and_says_so():
    answers = iter([False, False, True])
    assert wait_until(lambda: next(answers), 10.0, period=0.001)
    begun = time.monotonic()
    assert not wait_until(lambda: False, 0.05, period=0.01)
    assert time.monotonic() - begun >= 0.05
