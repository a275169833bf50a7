"""The private part of rospy that is changed: no publisher is overlooked that registers with a
subscriber."""
import pytest

pytest.importorskip('rospy')
from rospy.impl.registration import RegManager    # noqa: E402

from tb3_labs.ros.rospy_internals import join_updates    # noqa: E402


def test_an_answer_without_a_publisher_does_not_hide_one_of_its_topic_that_was_told_before():
    manager = RegManager(None)
    join_updates(manager)
    manager.publisher_update('/odom', ['http://robot:1/'])
    manager.publisher_update('/odom', [])
    assert manager.updates[-1] == ('/odom', ['http://robot:1/'])
    manager.publisher_update('/imu', ['http://robot:2/', 'http://robot:3/'])
    assert manager.updates[-1] == ('/imu', ['http://robot:2/', 'http://robot:3/'])
