"""Names of frames."""
import rospy


def frame(name):
    """`name` in this node's namespace: `robot3/odom` in /robot3, plain `odom` in the root.

    tf has one tree for all robots, so that each robot needs frames of its own.
    """
    namespace = rospy.get_namespace().strip('/')
    return '{}/{}'.format(namespace, name) if namespace else name
