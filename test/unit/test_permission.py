"""A permission stands until it is taken, unless it was being renewed."""
from tb3_labs.permission import LAPSE, Permission


def test_given_once_it_stands():
    permission = Permission()
    assert not permission.granted
    assert permission.told(True, 1.0) is True
    assert not permission.has_lapsed(1000.0) and permission.granted
    assert permission.told(False, 1001.0) is True and not permission.granted
    assert permission.told(False, 1002.0) is False


def test_renewed_it_lapses_when_nobody_renews_it():
    permission = Permission()
    for tick in range(10):
        permission.told(True, 0.2 * tick)
        assert not permission.has_lapsed(0.2 * tick)
    assert not permission.has_lapsed(1.8 + LAPSE) and permission.granted
    assert permission.has_lapsed(1.8 + LAPSE + 0.01) and not permission.granted
    assert not permission.has_lapsed(100.0)         # said once
    assert permission.told(True, 101.0) is True     # the holder is back


def test_given_twice_by_hand_is_no_renewal():
    permission = Permission()
    for now in (1.0, 1.5, 5.0, 9.0, 13.0):
        permission.told(True, now)
    assert not permission.has_lapsed(60.0)


def test_a_sender_that_will_renew_it_may_die_before_the_first_renewal():
    permission = Permission()
    assert permission.told(True, 1.0, will_be_renewed=True) is True
    assert not permission.has_lapsed(1.0 + LAPSE)
    assert permission.has_lapsed(1.0 + LAPSE + 0.01) and not permission.granted
