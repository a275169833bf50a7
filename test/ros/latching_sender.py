"""A student's node that latches `ctrl_relinq`. It sends each True or False that is typed.

When `again` is typed, the connections of the node break, so that rospy sends its last message again. When `goal` is
typed, the node sends an action goal, and latches it.
"""
import socket
import struct
import sys
import time

import rosgraph
import rospy
from move_base_msgs.msg import MoveBaseActionGoal
from std_msgs.msg import Bool

#: A subscriber notices the end of a connection within this time [s].
NOTICED = 0.1


def break_connections(publisher):
    """Reset the connections to all subscribers, as a network does. Subscribers connect again when the master announces
    a change of the publishers, so another publisher comes and goes."""
    for connection in list(publisher.impl.connections):
        link = connection.socket
        link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
        link.close()
    time.sleep(NOTICED)
    master, uri = rosgraph.Master('/passer_by'), rospy.get_node_uri()
    master.registerPublisher(publisher.resolved_name, publisher.type, uri)
    master.unregisterPublisher(publisher.resolved_name, uri)


def main():
    rospy.init_node('student')
    words = rospy.Publisher('ctrl_relinq', Bool, queue_size=5, latch=True)
    print('connected')
    for line in sys.stdin:
        if line.strip() == 'again':
            break_connections(words)
        elif line.strip() == 'goal':
            goals = rospy.Publisher('move2goal/goal', MoveBaseActionGoal, queue_size=1, latch=True)
            goals.publish(MoveBaseActionGoal())
        else:
            words.publish(line.strip() == 'True')
        print('said')


if __name__ == '__main__':
    main()
