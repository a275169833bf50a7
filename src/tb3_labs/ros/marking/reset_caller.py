"""Calls the reset service of a node, whatever its name and its type are."""
import threading

import rospy

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.move2goal import ANSWER_TIME
from tb3_labs.ros.marking.requests import fill_pose
from tb3_labs.ros.marking.waiting import wait_until

#: The names that the handouts lead to, likeliest first; then any that has one of WORDS in it.
NAMES = ('reset_pose', 'reset', 'set_pose', 'reset_local_pose', 'set_local_pose')
WORDS = ('reset', 'pose')


class ResetCaller:
    """The reset service of a node, of which `graph` knows; `found` is its name, '' if there is
    none."""

    def __init__(self, graph):
        def rank(name):
            base = name.rsplit('/', 1)[-1].lower()
            return (NAMES.index(base) if base in NAMES else len(NAMES), name)
        likely = sorted((name for name in graph.services() if any(
            word in name.rsplit('/', 1)[-1].lower() for word in WORDS)), key=rank)
        self.found = likely[0] if likely else ''
        #: What its request takes, as requests.fill_pose() says.
        self.takes = set()
        self._kind = None
        if self.found:
            self._kind = graph.service(self.found)
            if self._kind is not None:      # else call() tells
                self.takes = fill_pose(self._kind._request_class(), Pose2())

    def call(self, pose):
        """Declare a Pose2; '' or the reason why it failed."""
        if self._kind is None:
            return 'the type of {} cannot be loaded'.format(self.found)
        request = self._kind._request_class()
        fill_pose(request, pose)
        answers = []

        def ask():
            try:
                response = rospy.ServiceProxy(self.found, self._kind)(request)
                refused = getattr(response, 'success', True) is False
                answers.append('it was refused: {}'.format(getattr(response, 'message', ''))[:200]
                               if refused else '')
            except (rospy.ServiceException, rospy.ROSException, TypeError) as problem:
                answers.append(str(problem)[:200])
        threading.Thread(target=ask, daemon=True).start()
        if not wait_until(lambda: answers, ANSWER_TIME):
            return '{} did not answer within {:g} s'.format(self.found, ANSWER_TIME)
        return answers[0]
