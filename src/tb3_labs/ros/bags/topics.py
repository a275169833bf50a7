"""The topics of a recording: which are recorded, and which of them are one robot's, by type."""

IMU, ODOMETRY = 'sensor_msgs/Imu', 'nav_msgs/Odometry'
POSE, TWIST = 'geometry_msgs/PoseStamped', 'geometry_msgs/Twist'
STRING, TF = 'std_msgs/String', 'tf2_msgs/TFMessage'
LOG, POSE_ESTIMATE = 'rosgraph_msgs/Log', 'geometry_msgs/PoseWithCovarianceStamped'
#: RunData's field: (name of the topic, type), besides the IMU and the odometry.
OPTIONAL = {
    'commands': ('cmd_vel', TWIST), 'local_pose': ('local_pose', POSE),
    'ground_truth': ('ground_truth', POSE), 'goals': ('current_goal', POSE),
    'states': ('goal_state', STRING), 'resets': ('initialpose', POSE_ESTIMATE),
    'asked': ('turn', 'std_msgs/Float64'), 'control': ('ctrl_relinq', 'std_msgs/Bool')}
#: Topics by which a person drives, of any type.
DEVICES = 'joy', 'mouse_info'
#: What is recorded of a run: names in the robot's namespace, and names of the whole system.
RECORDED = ('imu', 'odom', 'cmd_vel', 'heading', 'ground_truth', 'local_pose', 'goal_state',
            'current_goal', 'ctrl_relinq', 'control_holder', 'joy', 'turn', 'mouse_info', 'reset',
            'initialpose', '/rosout', '/tf', '/tf_static', '/diagnostics')


class BagProblem(Exception):
    """No report can be made of a bag; one line with the reason and the remedy."""


def choose_topics(types, namespace):
    """{RunData's field: topic} of one robot: the one in `namespace` if there are several.

    `types` is {topic: (type, number of messages)}. Raises BagProblem.
    """
    prefix = None if namespace is None else '/{}/'.format(namespace.strip('/')).replace('//', '/')
    topics = {'imu': _by_type(types, IMU, 'imu', prefix),
              'odometry': _by_type(types, ODOMETRY, 'odom', prefix)}
    prefix = prefix or parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL.items():
        topic = next((topic for topic, (of, _) in types.items()
                      if of == kind and _absolute(topic) == prefix + name), None)
        if topic:
            topics[part] = topic
    if types.get('/tf', ('',))[0] == TF:
        topics['frames'] = '/tf'
    if types.get('/rosout', ('',))[0] == LOG:
        topics['resets'] = '/rosout'      # the answer to a reset says more than the request
    return topics


def devices(types, prefix):
    """Those of DEVICES that were recorded in the namespace `prefix`."""
    absolute = {_absolute(topic) for topic in types}
    return tuple(name for name in DEVICES if prefix + name in absolute)


def _by_type(types, kind, ending, prefix):
    """The topic of a type in `prefix`: the one named `ending` if there is one, else the busiest."""
    names = [topic for topic, (of, _) in types.items() if of == kind
             and (prefix is None or _absolute(topic).startswith(prefix))]
    if not names:
        raise BagProblem('no {} was recorded{}; the bag has: {}'.format(
            kind, ' in ' + prefix if prefix else '',
            ', '.join(sorted(types)) or 'no messages at all'))
    named = [topic for topic in names if topic.rsplit('/', 1)[-1] == ending]
    exact = [topic for topic in named if prefix and _absolute(topic) == prefix + ending]
    if exact:
        return exact[0]
    if len({parent(topic) for topic in named}) > 1:
        raise BagProblem('several robots were recorded ({}): choose one, such as --ns {}'.format(
            ', '.join(sorted(named)), parent(sorted(named)[-1]).strip('/') or '/'))
    return max(named or names, key=lambda topic: types[topic][1])


def _absolute(topic):
    """The absolute name: `rosbag record` keeps relative names as they were given."""
    return '/' + topic.lstrip('/')


def parent(topic):
    """The namespace of a topic: `/robot3/` of `/robot3/odom`."""
    return _absolute(topic).rpartition('/')[0] + '/'
