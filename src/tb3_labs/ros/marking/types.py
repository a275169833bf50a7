"""The types of a student's messages and services, made from their text.

Importing the student's own modules would run a stranger's code in the marker. Constants and
comments do not get into the classes, for the same reason.
"""
import importlib
import os
from types import SimpleNamespace

import genmsg
import genpy.dynamic
import rospkg
from genmsg.msg_loader import load_msg_from_file, load_srv_from_file

#: What genpy wants between the parts of a definition.
SEPARATOR = '=' * 80
PROBLEMS = (genmsg.InvalidMsgSpec, genmsg.MsgNotFound, genpy.dynamic.MsgGenerationException,
            rospkg.ResourceNotFound, OSError, UnicodeDecodeError, KeyError, ValueError)


class Types:
    """Knows the types that this process can import, and those in the packages below folders."""

    def __init__(self, folders=()):
        """`folders`: in which a student's packages are."""
        self._folders = [str(folder) for folder in folders]
        self._packs = rospkg.RosPack(self._folders + rospkg.get_ros_paths())

    def message(self, kind):
        """The class of a message type, such as 'lab2/MouseController'; None if there is none."""
        return self._imported(kind, 'msg') or self._made(kind, self._make_message)

    def service(self, kind):
        """The class of a service type; None if there is none."""
        return self._imported(kind, 'srv') or self._made(kind, self._make_service)

    def own_services(self):
        """The classes of all services in the packages below the folders."""
        return [kind for package in rospkg.RosPack(self._folders).list()
                for kind in self._services(package)] if self._folders else []

    def _services(self, package):
        """The classes of all services in a package, as far as they can be imported or made."""
        try:
            folder = os.path.join(self._packs.get_path(package), 'srv')
            names = sorted(os.listdir(folder))
        except (rospkg.ResourceNotFound, OSError):
            return []
        made = [self.service('{}/{}'.format(package, name[:-4])) for name in names
                if name.endswith('.srv')]
        return [kind for kind in made if kind is not None]

    @staticmethod
    def _imported(kind, what):
        package, _, name = kind.partition('/')
        try:
            return getattr(importlib.import_module('{}.{}'.format(package, what)), name, None)
        except ImportError:
            return None

    @staticmethod
    def _made(kind, make):
        try:
            return make(kind)
        except PROBLEMS:
            return None     # not there, or no valid definition

    def _path(self, kind, what):
        package, _, name = kind.partition('/')
        path = os.path.join(self._packs.get_path(package), what, '{}.{}'.format(name, what))
        if os.path.islink(path):
            raise OSError('{} is a link'.format(path))
        return path

    def _search_path(self):
        return {name: [os.path.join(self._packs.get_path(name), 'msg')]
                for name in self._packs.list()}

    def _make_message(self, kind):
        context = genmsg.MsgContext.create_default()
        spec = load_msg_from_file(context, self._path(kind, 'msg'), kind)
        genmsg.load_depends(context, spec, self._search_path())
        made = _class_of(context, spec)
        made._md5sum = genmsg.compute_md5(context, spec)    # constants count there
        return made

    def _make_service(self, kind):
        context = genmsg.MsgContext.create_default()
        spec = load_srv_from_file(context, self._path(kind, 'srv'), kind)
        genmsg.load_depends(context, spec, self._search_path())
        return SimpleNamespace(_type=kind, _md5sum=genmsg.compute_md5(context, spec),
                               _request_class=_class_of(context, spec.request),
                               _response_class=_class_of(context, spec.response))


def _class_of(context, spec):
    """The class of a message, from the names and types of its fields alone."""
    parts, known, open_ = [_fields_of(spec)], set(), [spec]
    while open_:
        for field in open_.pop().parsed_fields():
            if field.is_builtin and not field.is_header or field.base_type in known:
                continue
            known.add(field.base_type)
            inner = context.get_registered(field.base_type)
            parts.append('{}\nMSG: {}\n{}'.format(SEPARATOR, field.base_type, _fields_of(inner)))
            open_.append(inner)
    return genpy.dynamic.generate_dynamic(spec.full_name, '\n'.join(parts))[spec.full_name]


def _fields_of(spec):
    return '\n'.join('{} {}'.format(kind, name) for kind, name in zip(spec.types, spec.names))
