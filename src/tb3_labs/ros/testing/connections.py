"""The topics that connect nodes, as the nodes themselves report them."""
import xmlrpc.client

import rosgraph
import rospy

from tb3_labs.ros.clocks import wait_until


def comes_to_hear(node, topics, seconds):
    """Wait until `node` is connected to all publishers of each of `topics`; False if it is not,
    after `seconds` of wall time."""
    return wait_until(lambda: all(_hears(node, topic) for topic in topics), seconds)


def _hears(node, topic):
    """Is `node` connected to all publishers of `topic`, and is there one?"""
    node, topic = rospy.resolve_name(node), rospy.resolve_name(topic)
    master = rosgraph.Master(rospy.get_name())
    publishers = dict(master.getSystemState()[0]).get(topic, [])
    try:
        return bool(publishers) and all(
            (topic, node) in _links_from(master.lookupNode(publisher)) for publisher in publishers)
    except (OSError, rosgraph.MasterException):    # one of them has just ended
        return False


def _links_from(uri):
    """{(topic, node that is connected to it)} of the node at `uri`, by ROS's slave API."""
    _, _, links = xmlrpc.client.ServerProxy(uri).getBusInfo(rospy.get_name())
    return {(topic, node) for _, node, direction, _, topic, *_ in links if direction == 'o'}
