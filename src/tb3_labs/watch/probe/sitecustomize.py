"""The probe shows the variables of a Python node while the node runs, in the node's own process.

Python imports sitecustomize when it starts, and scripts/watch.py puts this folder on the node's
path. The probe removes the folder again, so that the node has its usual path. A thread of the probe
waits until the node calls rospy.init_node(). After this call, the thread publishes the node's
variables 20 times a second, if the topic has a subscriber:

    variables    diagnostic_msgs/DiagnosticArray, with the node's name and its variables

The probe shows variables of the node's objects, of its script, and of the functions that run. It
calls no function of the node and changes nothing. None of its errors reaches the node.
"""
import gc
import os
import signal
import sys
import threading
import time
import weakref
from collections import Counter
from contextlib import suppress
from enum import Enum
from types import FunctionType, ModuleType

READ_PAUSE = 0.05               # [s]
MIN_SEARCH_PAUSE = 0.25         # [s]
#: The searches for objects take at most this share of the time.
MAX_SEARCH_SHARE = 0.003
MAX_SHOWN_VARIABLES = 40
MAX_OBJECTS = 20
MAX_OBJECTS_OF_A_CLASS = 3
MAX_VALUE_LENGTH = 200
MAX_DEPTH_OF_PARTS = 3
#: The repr() of a value of SIMPLE_TYPES is shown. A value of HIDDEN_TYPES is not shown.
SIMPLE_TYPES = {bool, float, type(None)}
HIDDEN_TYPES = {FunctionType, ModuleType, type, property, staticmethod, classmethod}


def leave_the_path():
    """Remove this folder from the path, and import the next sitecustomize on the path."""
    own_folder = os.path.dirname(os.path.abspath(__file__))
    sys.path[:] = [folder for folder in sys.path if folder != own_folder]
    folders = os.environ.pop('PYTHONPATH', '').split(os.pathsep)
    remaining = os.pathsep.join(folder for folder in folders if folder != own_folder)
    if remaining:
        os.environ['PYTHONPATH'] = remaining
    this_module = sys.modules.pop(__name__)
    try:
        import sitecustomize    # noqa: F401
    except ImportError as error:
        if error.name != __name__:
            raise
    finally:
        sys.modules.setdefault(__name__, this_module)


# -- the node's script and its objects

def script_stack():
    """Returns the stack frames of the node's script, outermost first, or [] before it runs."""
    stack = []
    frame = sys._current_frames().get(threading.main_thread().ident)
    while frame is not None:
        stack.insert(0, frame)
        frame = frame.f_back
    while stack and not is_main(stack[0]):
        del stack[0]
    # catkin's relay is a main program that runs the node's script as a second main program
    while len(stack) > 1 and is_main(stack[1]):
        del stack[0]
    return [frame for frame in stack if frame.f_globals is stack[0].f_globals]


def is_main(frame):
    return frame.f_code.co_name == '<module>' and frame.f_globals.get('__name__') == '__main__'


class WatchedNode:
    """Finds the objects of the node's own classes, and reads their variables."""

    def __init__(self, script):
        """`script` contains the globals of the node's main program."""
        self._script = script
        self._folder = os.path.dirname(os.path.abspath(str(script.get('__file__', ''))))
        self._package = self._folder
        while self._package != '/' and not os.path.isfile(self._package + '/package.xml'):
            self._package = os.path.dirname(self._package)
        self._own_classes = {WatchedNode: False}
        self._objects = []
        self._next_search = 0.0

    def is_own(self, cls):
        """Returns True if a class is of the script, a module beside it, or the package's `src`."""
        if cls not in self._own_classes:
            name = module_of(cls)
            path = getattr(sys.modules.get(name), '__file__', None)
            folder = os.path.dirname(os.path.abspath(path)) if path else ''
            is_of_tb3_labs = name.split('.')[0] == 'tb3_labs'
            is_near = folder == self._folder or (folder + '/').startswith(self._package + '/src/')
            self._own_classes[cls] = name == '__main__' or (is_near and not is_of_tb3_labs)
        return self._own_classes[cls]

    def is_own_object(self, value):
        """Returns True if the class is own, and the value is no type, Enum, tuple or exception."""
        return self.is_own(type(value)) and not issubclass(
            type(value), (type, Enum, tuple, BaseException))

    def variables(self, stack):
        """Returns {name: text of the value} of at most MAX_SHOWN_VARIABLES variables."""
        if time.monotonic() > self._next_search:
            self._search()
        referents = [reference() for reference in self._objects]
        objects = [thing for thing in referents if thing is not None]
        attributes_of = {id(thing): attributes(thing) for thing in objects}
        part_ids = {id(part) for parts in attributes_of.values() for part in parts.values()}
        shown = {}
        shown_ids = set()
        # objects that are no part of another object come first, because they also show their parts
        for thing in sorted(objects, key=lambda thing: id(thing) in part_ids):
            if id(thing) not in shown_ids:
                shown_ids.add(id(thing))
                self._show(shown, attributes_of[id(thing)], type(thing).__name__, shown_ids)
        for frame in stack[1:]:
            self._show(shown, dict(frame.f_locals), frame.f_code.co_name, shown_ids)
        self._show(shown, dict(self._script), 'globals', shown_ids)
        for thing in objects:
            for cls in filter(self.is_own, type(thing).__mro__):
                class_variables = {name: value for name, value in list(vars(cls).items())
                                   if name not in attributes_of[id(thing)]}
                self._show(shown, class_variables, cls.__name__, shown_ids)
        return shown

    def _search(self):
        self._next_search = time.monotonic() + MIN_SEARCH_PAUSE
        begin = time.thread_time()
        counts = Counter()
        self._objects = []
        for thing in gc.get_objects():
            if self.is_own_object(thing):
                counts[type(thing)] += 1
                is_wanted = counts[type(thing)] <= MAX_OBJECTS_OF_A_CLASS
                if is_wanted and len(self._objects) < MAX_OBJECTS:
                    with suppress(TypeError):   # a class with __slots__ has no weak references
                        self._objects.append(weakref.ref(thing))
        self._next_search += (time.thread_time() - begin) / MAX_SEARCH_SHARE

    def _show(self, shown, variables, owner, shown_ids):
        """Add variables to `shown`. If `shown` has a name already, `owner` is put before it."""
        for name, value in variables.items():
            if len(shown) >= MAX_SHOWN_VARIABLES:
                return
            with suppress(Exception):       # a value that cannot be read is left out
                if type(value) in HIDDEN_TYPES or name.startswith('__'):
                    continue
                # the private name _Class__name is shown as __name
                name = name.replace(f"_{owner.lstrip('_')}__", '__')
                for path, text in self._leaf_texts(name, value, shown_ids):
                    if path in shown:
                        path = f'{owner}.{path}'
                    if len(shown) < MAX_SHOWN_VARIABLES:
                        shown.setdefault(sendable(path), text)

    def _leaf_texts(self, name, value, shown_ids, depth=0):
        """Yields (name, text) of a simple value, or of each part of a message or an object."""
        text = simple_text(value)
        if text is not None:
            yield name, text
            return
        if depth < MAX_DEPTH_OF_PARTS:
            for part, part_value in self._parts_of(value, shown_ids).items():
                yield from self._leaf_texts(f'{name}.{part}', part_value, shown_ids, depth + 1)

    def _parts_of(self, value, shown_ids):
        cls = type(value)
        if module_of(cls).startswith('geometry_msgs.msg'):
            return {part: getattr(value, part, None) for part in cls.__slots__}
        if self.is_own_object(value) and id(value) not in shown_ids:
            shown_ids.add(id(value))
            return attributes(value)
        return {}


def simple_text(value):
    """Returns the text of a simple value, or None for any other value."""
    cls = type(value)
    if cls in SIMPLE_TYPES or (cls is int and value.bit_length() <= 3 * MAX_VALUE_LENGTH):
        return repr(value)
    if cls is str:
        return sendable(value)
    if issubclass(cls, Enum):
        return sendable(str(vars(value).get('_name_')))
    if module_of(cls) == 'numpy' and cls.__name__.startswith(('float', 'int', 'uint', 'bool')):
        return repr(value.item())
    return None


def module_of(cls):
    """Returns the name of a class's module, and runs no code of a metaclass."""
    name = type.__dict__['__module__'].__get__(cls)
    return name if type(name) is str else ''


def sendable(text):
    """Returns the first characters of a text. A '?' replaces what UTF-8 cannot encode."""
    text = text[:MAX_VALUE_LENGTH]
    return text if text.isascii() else text.encode('utf-8', 'replace').decode('utf-8')


def attributes(thing):
    """Returns {name: value} of an object's attributes, and runs no code of the object's class."""
    try:
        return dict(object.__getattribute__(thing, '__dict__'))
    except AttributeError:      # an object of a class with __slots__ has no __dict__
        return {}


# -- the thread

def rospy_runs():
    """Returns True if the node has called init_node()."""
    core = sys.modules.get('rospy.core')
    return hasattr(core, 'is_initialized') and core.is_initialized()


def publish_variables():
    """Wait for the node, and publish its variables until the process ends."""
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())     # the node handles signals
    while not rospy_runs():
        time.sleep(READ_PAUSE)
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    publisher = rospy.Publisher('variables', DiagnosticArray, queue_size=1)
    node = None
    status = DiagnosticStatus(name=rospy.get_name())
    message = DiagnosticArray(status=[status])

    def publish_once():         # when this function returns, it releases the node's stack frames
        nonlocal node
        stack = script_stack()
        if node is None and stack:
            node = WatchedNode(stack[0].f_globals)
        if node and publisher.get_num_connections():
            status.values = [KeyValue(name, text) for name, text in node.variables(stack).items()]
            message.header.stamp = rospy.Time.now()
            publisher.publish(message)

    while not rospy.is_shutdown():
        time.sleep(READ_PAUSE)
        with suppress(Exception):       # an error of the probe must not disturb the node
            publish_once()


def publish_quietly():
    """Publish the variables. Print no traceback if a library is missing or the master has ended."""
    with suppress(Exception):
        publish_variables()


if __name__ == 'sitecustomize':
    leave_the_path()
    threading.Thread(target=publish_quietly, name='variables', daemon=True).start()
