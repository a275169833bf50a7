"""A node that waits for the robot says so; it does not wait without a word."""
import threading
import time

import rospy

#: Time before the first line, and between later ones [s, wall clock].
FIRST_LINE = 2.0
NEXT_LINE = 10.0


def say_what_is_awaited(heard):
    """Start a thread that names the topics of which nothing was heard yet; `heard` is {topic:
    function: was anything heard of it?}. It ends when all were heard."""
    threading.Thread(target=_run, args=(heard,), name='awaited', daemon=True).start()


def _run(heard):
    time.sleep(FIRST_LINE)
    while not rospy.is_shutdown():
        missing = [rospy.resolve_name(topic) for topic, was_heard in heard.items()
                   if not was_heard()]
        if not missing:
            return
        rospy.loginfo('Waiting for %s: is the robot running?', ' and '.join(missing))
        time.sleep(NEXT_LINE)
