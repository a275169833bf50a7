"""The probe: shows the variables of a Python node while it runs, from within its process.

Python imports a module of this name at its start. scripts/watch.py puts this folder on the path of
the node that it starts; the probe takes it off again, so that the node sees the path of a usual
start. A thread waits until the node calls rospy.init_node(). Then it reads the node's variables 20
times a second, and publishes them

    variables    diagnostic_msgs/DiagnosticArray: the node's name and file, and a key and a value
                 for each variable

while somebody listens. It reads what the node's objects, its script and its running functions hold.
It calls nothing of the node, changes nothing, and no error of it reaches the node.
"""
import gc
import os
import signal
import sys
import threading
import time
import weakref
from collections import Counter
from enum import Enum
from types import FunctionType, MemberDescriptorType, ModuleType

#: The pause between two readings, and the longest pause between two searches for objects [s].
READ_PAUSE, LONGEST_PAUSE = 0.05, 16.0
#: A search for objects takes at most this part of the time.
SEARCH_SHARE = 0.003
#: At most this many variables, objects, and objects of a class are shown. The last two limit the
#: characters of a text, and the numbers of an array or a list.
MOST_SHOWN, MOST_OBJECTS, MOST_OF_A_CLASS, LONGEST_VALUE, MOST_NUMBERS = 40, 20, 3, 200, 9
#: Values of SIMPLE_TYPES are shown as Python writes them. Values of HIDDEN_TYPES are not shown.
SIMPLE_TYPES = {bool, float, type(None)}
HIDDEN_TYPES = {FunctionType, ModuleType, type, property, staticmethod, classmethod}
#: What each thread holds.
THREAD_ATTRIBUTES = frozenset(vars(threading.main_thread()))
#: An object within an object within an object is the last one.
MOST_NESTED = 3


def leave_the_path():
    """Take this folder off the path, and run the system's own module of this name."""
    own = os.path.dirname(os.path.abspath(__file__))
    sys.path[:] = [folder for folder in sys.path if folder != own]
    folders = os.environ.get('PYTHONPATH', '').split(os.pathsep)
    left = os.pathsep.join(folder for folder in folders if folder != own)
    os.environ.pop('PYTHONPATH', None)
    os.environ.update({'PYTHONPATH': left} if left else {})
    this = sys.modules.pop(__name__)
    try:
        import sitecustomize    # noqa: F401
    except ImportError as problem:
        if problem.name != __name__:
            raise
    finally:
        sys.modules.setdefault(__name__, this)


# -- the node's script and its objects

def script_frames():
    """The running functions of the node's script, its main program first; [] before it runs."""
    frame, frames = sys._current_frames().get(threading.main_thread().ident), []
    while frame is not None:
        frames.insert(0, frame)
        frame = frame.f_back
    mains = [k for k, each in enumerate(frames) if each.f_code.co_name == '<module>'
             and each.f_globals.get('__name__') == '__main__']
    # catkin's relay runs the script as a second main program within its own
    last = mains and max(k for n, k in enumerate(mains) if k == mains[0] + n)
    return [frame for frame in frames[last:] if frame.f_globals is frames[last].f_globals] \
        if mains else []


class WatchedNode:
    """The node's own classes, its objects, and what they hold."""

    def __init__(self, script):
        """`script`: the globals of its main program."""
        self._script, self.file = script, str(script.get('__file__', ''))
        self._folder = self._package = os.path.dirname(os.path.abspath(self.file))
        while self._package != '/' and not os.path.isfile(self._package + '/package.xml'):
            self._package = os.path.dirname(self._package)
        self._is_own, self._objects, self._pause, self._next = {WatchedNode: False}, [], 0.25, 0.0

    def is_own(self, kind):
        """Is this a class of the script, or of a module beside it or in src of its package?"""
        if kind not in self._is_own:
            name = module_of(kind)
            path = getattr(sys.modules.get(name), '__file__', None)
            folder = os.path.dirname(os.path.abspath(path)) if path else ''
            self._is_own[kind] = name == '__main__' or name.split('.')[0] != 'tb3_labs' and (
                folder == self._folder or (folder + '/').startswith(self._package + '/src/'))
        return self._is_own[kind]

    def is_object(self, value):
        """Is this an object of one of its own classes?"""
        return self.is_own(type(value)) and not issubclass(
            type(value), (type, Enum, tuple, BaseException))

    def variables(self, frames):
        """{name: value as text} of the variables that can be shown, MOST_SHOWN of them."""
        if time.monotonic() > self._next:
            self._search()
        objects = [each for each in (reference() for reference in self._objects)
                   if each is not None]
        held = {id(each): attributes(each) for each in objects}
        inner = {id(part) for each in held.values() for part in each.values()}
        found, known = {}, set()
        # a name that is taken gets that of its class or its function
        for each in sorted(objects, key=lambda each: id(each) in inner):
            if id(each) not in known:
                known.add(id(each))
                self._add(found, held[id(each)], type(each).__name__, known)
        for frame in frames[1:]:
            self._add(found, dict(frame.f_locals), frame.f_code.co_name, known)
        self._add(found, dict(self._script), 'globals', known)
        for each in objects:
            for kind in filter(self.is_own, type(each).__mro__):
                self._add(found, {name: value for name, value in list(vars(kind).items())
                                  if name not in held[id(each)]}, kind.__name__, known)
        return found

    def _search(self):
        """Find the node's objects, which it may create later than its main program begins."""
        begin, counts, self._objects = time.thread_time(), Counter(), []
        self._next = time.monotonic() + self._pause
        for each in gc.get_objects():
            if self.is_object(each):
                counts[type(each)] += 1
                if counts[type(each)] <= MOST_OF_A_CLASS and len(self._objects) < MOST_OBJECTS:
                    self._objects.append(reference_to(each))
        self._next = time.monotonic() + max(
            self._pause, (time.thread_time() - begin) / SEARCH_SHARE)
        self._pause = min(LONGEST_PAUSE, 4.0 * self._pause)

    def _add(self, found, held, owner, known):
        for name, value in held.items():
            if len(found) >= MOST_SHOWN:
                return
            try:
                if type(value) in HIDDEN_TYPES or name.startswith('__'):
                    continue
                name = name.replace(f"_{owner.lstrip('_')}__", '__')    # a private one
                for path, text in self._texts(name, value, known):
                    path = path if path not in found else f'{owner}.{path}'
                    if len(found) < MOST_SHOWN:
                        found.setdefault(sendable(path), text)
            except Exception:       # a value that is unlike all others hides no other one
                pass

    def _texts(self, name, value, known, depth=0):
        """[(name, text)] of a simple value, or of the parts of another one."""
        kind, module = type(value), module_of(type(value))
        if kind in SIMPLE_TYPES or kind is int and value.bit_length() <= 3 * LONGEST_VALUE:
            yield name, repr(value)
        elif kind is str:
            yield name, sendable(value)
        elif issubclass(kind, Enum):
            yield name, sendable(str(vars(value).get('_name_')))
        elif module == 'numpy':
            if kind.__name__ == 'ndarray':
                if 0 < value.size <= MOST_NUMBERS and value.dtype.kind in 'bif':
                    yield from self._texts(name, value.ravel().tolist(), known)
            elif kind.__name__.startswith(('float', 'int', 'uint', 'bool')):
                yield name, repr(value.item())
        elif kind in (list, tuple) and len(value) <= MOST_NUMBERS:
            for k, each in enumerate(list(value)):
                if type(each) in (bool, int, float):
                    yield from self._texts(f'{name}[{k}]', each, known)
        elif depth < MOST_NESTED:
            parts = {}
            if module.startswith('geometry_msgs.msg'):
                parts = {part: getattr(value, part, None) for part in kind.__slots__}
            elif self.is_object(value) and id(value) not in known:
                known.add(id(value))
                parts = attributes(value)
            elif issubclass(kind, tuple) and self.is_own(kind):
                parts = dict(zip(kind._fields, tuple.__iter__(value)))
            elif kind is dict and len(value) <= MOST_NUMBERS:
                parts = {part: each for part, each in list(value.items()) if type(part) is str}
            for part, each in parts.items():
                yield from self._texts(f'{name}.{part}', each, known, depth + 1)


def module_of(kind):
    """The name of a class's module; no code of a metaclass is run."""
    name = type.__dict__['__module__'].__get__(kind)
    return name if type(name) is str else ''


def reference_to(thing):
    """A function that returns the object; None after the node has dropped it."""
    try:
        return weakref.ref(thing)
    except TypeError:       # of a class with __slots__
        return lambda: thing


def sendable(text):
    """The beginning of a text, without what UTF-8 lacks."""
    text = text[:LONGEST_VALUE]
    return text if text.isascii() else text.encode('utf-8', 'replace').decode('utf-8')


def attributes(thing):
    """{name: value} of an object's attributes; no code of its class is run."""
    held = {}
    for kind in type(thing).__mro__:
        for name, slot in list(vars(kind).items()):
            if type(slot) is MemberDescriptorType:
                try:
                    held[name] = slot.__get__(thing)
                except AttributeError:      # not set yet
                    pass
    try:
        held.update(object.__getattribute__(thing, '__dict__'))
    except AttributeError:
        pass
    return {name: value for name, value in held.items() if name not in THREAD_ATTRIBUTES} \
        if issubclass(type(thing), threading.Thread) else held


# -- the thread

def run():
    """Wait for the node, and publish its variables until it ends."""
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())     # they are the node's
    while not getattr(sys.modules.get('rospy.core'), 'is_initialized', bool)():
        time.sleep(READ_PAUSE)
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    publisher = rospy.Publisher('variables', DiagnosticArray, queue_size=1)
    node, status = None, DiagnosticStatus(name=rospy.get_name())
    message = DiagnosticArray(status=[status])

    def read():
        """Nothing of the node outlives this reading, not even the frame of a function."""
        nonlocal node
        frames = script_frames()
        node = node or frames and WatchedNode(frames[0].f_globals)
        if node and publisher.get_num_connections():
            found = node.variables(frames)
            if [each.key for each in status.values] != list(found):     # new ones cost more
                status.hardware_id = node.file
                status.values = [KeyValue(key=name) for name in found]
            for each, text in zip(status.values, found.values()):
                each.value = text
            message.header.stamp = rospy.Time.now()
            publisher.publish(message)

    while not rospy.is_shutdown():
        time.sleep(READ_PAUSE)
        try:
            read()
        except Exception:       # whatever a node holds, it is not disturbed
            pass


def run_quietly():
    """Run without a traceback: a library that is missing, a master that has gone."""
    try:
        run()
    except Exception:
        pass


if __name__ == 'sitecustomize':
    leave_the_path()
    threading.Thread(target=run_quietly, name='variables', daemon=True).start()
