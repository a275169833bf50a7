"""The rehearsal of a launch: it is loaded as roslaunch does it, and nothing is started."""
import os
import re
import shlex
import shutil
import xmlrpc.client

import rosgraph
import rospkg
from rosgraph.names import ns_join
from rosgraph.network import create_local_xmlrpc_uri
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.xmlloader import XmlLoader

from tb3_labs.config import NOT_GIVEN, from_parameters
from tb3_labs.robot.turtlebot3 import model_called
from tb3_labs.ros.launching import arguments
from tb3_labs.ros.launching.node_source import NodeSource
from tb3_labs.ros.launching.optional import how_to_install, path_of
from tb3_labs.ros.launching.recording import problem_of_folder

PACKAGE = 'tb3_labs'
#: What may be missing although a launch file names it: gamepad.launch also serves the page's pad.
#: The node says what to install.
MAY_BE_MISSING = ('joy',)
#: The name by which the master is asked.
CALLER = '/check_launch'


def problem_of(command):
    """One sentence on why a Command cannot be carried out as it was asked for, or ''."""
    problem = arguments.problem_of(command.file, command.arguments)
    if problem:
        return problem
    try:
        config = loaded(command)
    except (RLException, ValueError, rospkg.ResourceNotFound) as error:
        return _reason(error)
    return (arguments.without_effect(command.file, command.arguments, config.roslaunch_files)
            or next(filter(None, (_problem_of_node(node, config) for node in config.nodes)), '')
            or _running_already(config))


def loaded(command):
    """The ROSLaunchConfig of a Command, without roscore's own part, which starts two programs."""
    config = ROSLaunchConfig()
    if command.port:
        config.master.uri = create_local_xmlrpc_uri(int(command.port))
    loader = XmlLoader()
    loader.ignore_unset_args = False
    loader.load(command.file, config, argv=command.words, verbose=False)
    return config


def _reason(error):
    """The reason within an error of roslaunch, without the XML and the files that it came through;
    '' if that cannot be told, since roslaunch tells it itself."""
    quoted = re.search(r"with base 10: '(.*?)'", str(error))     # see classroom.launch
    return quoted.group(1) if quoted else ''


def _problem_of_node(node, config):
    parameters = _parameters(node, config)
    if node.launch_prefix and not shutil.which(shlex.split(node.launch_prefix)[0]):
        name = shlex.split(node.launch_prefix)[0]
        return '{0} is not installed: sudo apt install {0}'.format(name)
    if node.package != PACKAGE:
        return ''
    if node.type == 'start_optional.py':
        return _problem_of_optional(*shlex.split(node.args)[:2])
    if node.type == 'record_run.py':
        return _problem_of_recording(shlex.split(node.args))
    return _problem_of_parameters(ns_join(node.namespace, node.name), node.type, parameters)


def _parameters(node, config):
    """{name: value} of a node's own parameters, as they would be on the server."""
    place = ns_join(node.namespace, node.name) + '/'
    return {key[len(place):]: parameter.value for key, parameter in config.params.items()
            if key.startswith(place)}


def _problem_of_optional(package, what):
    """Of another package's node or launch file, which start_optional.py would start."""
    if package in MAY_BE_MISSING:
        return ''
    if not path_of(package, what):
        return how_to_install(package)
    if package == 'rviz' and not os.environ.get('DISPLAY'):
        return 'RViz needs a screen, and DISPLAY is not set; web:=true shows the robot in any browser'
    return ''


def _problem_of_recording(words):
    if not path_of('rosbag', 'record'):
        return how_to_install('rosbag')
    return problem_of_folder(words[words.index('-o') + 1])


def _problem_of_parameters(name, script, given):
    path = os.path.join(rospkg.RosPack().get_path(PACKAGE), 'scripts', script)
    if not os.path.exists(path):    # where it was installed
        path = path_of(PACKAGE, script)
    with open(path) as file:
        source = NodeSource(file.read())
    try:
        for kind in source.configs:
            from_parameters(kind, given)
        if source.has_model:
            model_called(given.get('model', NOT_GIVEN), os.environ)
    except ValueError as problem:
        return 'parameter {}/{}'.format(name, problem)
    return ''


def _running_already(config):
    """Names the nodes that the master knows by the names of this launch: each would end its
    namesake."""
    master = rosgraph.Master(CALLER, config.master.uri)
    try:
        known = {node for kind in master.getSystemState() for _, nodes in kind for node in nodes}
    except (OSError, rosgraph.MasterException):
        return ''    # no master yet
    names = [name for name in (ns_join(node.namespace, node.name) for node in config.nodes)
             if name in known and _answers(master, name)]
    if not names:
        return ''
    return 'running already at {}: {}; end that launch first, or set another ROS_MASTER_URI or ' \
        'ROS_NAMESPACE'.format(config.master.uri, ', '.join(names))


def _answers(master, name):
    try:
        return bool(xmlrpc.client.ServerProxy(master.lookupNode(name)).getPid(CALLER))
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return False
