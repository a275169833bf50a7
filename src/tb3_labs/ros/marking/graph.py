"""What the master knows of a student's node: its topics, its services, its messages."""
import rosgraph
import rosnode
import rospy
import rosservice

#: What a node does with a topic, or a service.
ROLES = PUBLISHES, LISTENS, OFFERS = 'publishes', 'listens', 'offers'


class Graph:
    """Asks the master; if it does not answer, no node is known."""

    def __init__(self, types):
        """`types`: the Types of the node's messages and services."""
        self.types = types
        self._master = rosgraph.Master(rospy.get_name())
        #: The names of the node; a process may be several nodes, or rename itself.
        self.names = set()

    def nodes(self):
        """name -> what it registered, of each node but this one: a set of (role, name of the topic
        or service), where the role is one of ROLES."""
        try:
            publishers, subscribers, services = self._master.getSystemState()
        except (OSError, rosgraph.MasterException):
            return {}
        nodes = {}
        for role, groups in zip(ROLES, (publishers, subscribers, services)):
            for topic, names in groups:
                for name in names:
                    nodes.setdefault(name, set()).add((role, topic))
        nodes.pop(rospy.get_name(), None)
        return nodes

    def services(self):
        """The names of the node's services, but for those that every node has."""
        _, _, services = self._master.getSystemState()
        return [name for name, nodes in services if self.names.intersection(nodes)
                and not name.endswith(('/get_loggers', '/set_logger_level'))]

    def listens_to(self, topic):
        """Does the node listen to `topic`?"""
        topic, nodes = rospy.resolve_name(topic), self.nodes()
        return any((LISTENS, topic) in nodes.get(name, ()) for name in self.names)

    def kind_of(self, topic):
        """The message class that the node itself uses on `topic`; None if there is none."""
        for name, kind in self._master.getTopicTypes():
            if name == rospy.resolve_name(topic):
                return self.types.message(kind)
        return None

    def service(self, name):
        """The class of a service that is offered; None if its type is not known here."""
        try:
            kind = rosservice.get_service_type(name)
        except (rosservice.ROSServiceException, OSError):
            return None
        return self.types.service(kind) if kind else None

    def forget(self):
        """Have the master forget the node: one that was killed is still registered."""
        left = [name for name in self.names if name in self.nodes()]
        if left:
            rosnode.cleanup_master_blacklist(self._master, left)
