"""Prints what a node's core has to tell."""
import rospy


def log_news(news):
    """Log each News line; warnings as such."""
    for line in news:
        (rospy.logwarn if line.warning else rospy.loginfo)('%s', line.text)
