"""The world of one submission: its environment, and the end of every process in it.

A process of a submission is known by a cookie in its environment, so that also one which left its
process group is found.
"""
import os
import signal
import sys

#: The variable of the cookie; each try of a submission has a value of its own.
COOKIE = 'TB3_LABS_SUBMISSION'
#: Variables of the caller that would change the result.
FORGOTTEN = ('ROS_MASTER_URI', 'ROS_IP', 'ROS_NAMESPACE', 'TURTLEBOT3_MODEL', 'ROSCONSOLE_FORMAT',
             'DISPLAY', 'WAYLAND_DISPLAY')
#: Those of the caller that list folders of catkin's workspaces.
LISTS = ('CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PATH', 'PKG_CONFIG_PATH', 'PYTHONPATH',
         'ROS_PACKAGE_PATH')
#: The master alone: rosout would write to a file what a node floods it with.
ROSCORE = '<launch/>'
#: Log lines go to the terminal as usual, but to no file.
LOGGING = '''[loggers]
keys=root,rosout
[handlers]
keys=stream
[formatters]
keys=plain
[logger_root]
level=INFO
handlers=
[logger_rosout]
level=INFO
handlers=stream
propagate=0
qualname=rosout
[handler_stream]
class=rosgraph.roslogging.RosStreamHandler
level=DEBUG
formatter=plain
args=(True,)
[formatter_plain]
format=[%(name)s][%(levelname)s] %(asctime)s: %(message)s
'''


def environment_in(work, environment):
    """The environment of a ROS of its own, which writes nowhere but below `work`, an existing
    folder; `environment`: that of the submission's workspace."""
    settings = work / 'etc'
    settings.mkdir(exist_ok=True)
    (settings / 'roscore.xml').write_text(ROSCORE)
    (settings / 'logging.conf').write_text(LOGGING)
    given = {name: value for name, value in environment.items() if name not in FORGOTTEN}
    return dict(given, ROS_HOSTNAME='localhost', ROS_HOME=str(work / 'ros'),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(settings / 'logging.conf'),
                ROS_TEST_RESULTS_DIR=str(work / 'results'))


def forget_overlays(environment=os.environ, modules=sys.path):
    """Take the catkin workspaces that go before this package's out of an environment, and out of
    Python's search path: an instructor's own nodes and messages must not stand in for those of a
    submission, nor be read by it. Both are changed."""
    prefixes = [path for path in environment.get('CMAKE_PREFIX_PATH', '').split(':') if path]
    holders = [number for number, prefix in enumerate(prefixes)
               if os.path.isdir(os.path.join(prefix, 'share', 'tb3_labs'))]
    overlays = prefixes[:holders[0]] if holders else []
    sources = {source for prefix in overlays for source in _sources_of(prefix)}

    def stays(path):
        return path not in sources and not any(
            (path + '/').startswith(prefix.rstrip('/') + '/') for prefix in overlays)
    for name in LISTS:
        if name in environment:
            environment[name] = ':'.join(filter(stays, environment[name].split(':')))
    modules[:] = filter(stays, modules)


def _sources_of(prefix):
    """The source folders of a devel space of catkin; those of any other folder: none."""
    try:
        with open(os.path.join(prefix, '.catkin')) as file:
            return file.read().split(';')
    except OSError:
        return ()


def sweep(cookie):
    """Kill every process that has this cookie in its environment, until there is none."""
    mark = '{}={}'.format(COOKIE, cookie).encode()
    while True:
        found = [number for number in os.listdir('/proc') if number.isdigit()
                 and mark in _environment_of(number)]
        if not found:
            return
        for number in found:
            try:
                os.kill(int(number), signal.SIGKILL)
            except ProcessLookupError:
                pass    # it has ended already


def _environment_of(number):
    try:
        with open('/proc/{}/environ'.format(number), 'rb') as file:
            return file.read().split(b'\0')
    except OSError:
        return ()
