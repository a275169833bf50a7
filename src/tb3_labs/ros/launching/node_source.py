"""The settings of a node, read from its script; the script itself does not run."""
import ast
import importlib

from tb3_labs.config import Config


class NodeSource:
    """The source of a node of this package."""

    def __init__(self, text):
        self._tree = ast.parse(text)

    @property
    def name(self):
        """The name that the node gives itself."""
        return self._calls('run')[0].args[0].value

    @property
    def has_model(self):
        """Does it read the robot's model?"""
        return bool(self._calls('read_model'))

    @property
    def configs(self):
        """The configuration classes that the node reads its parameters into."""
        own = [call for call in self._calls('read_config') if not call.keywords]
        known = self._known() if own else {}
        return [known[kind.id] for call in own for kind in call.args]

    def _calls(self, function):
        return [node for node in ast.walk(self._tree) if isinstance(node, ast.Call)
                and getattr(node.func, 'id', None) == function]

    def _known(self):
        """{name: object} of the script's imports without ROS, and of its own configurations."""
        known = {}
        for node in self._tree.body:
            if isinstance(node, ast.ImportFrom):
                room = node.module.split('.')
                if room[0] == 'dataclasses' or (
                        room[0] == 'tb3_labs' and room[1] not in ('ros', 'msg', 'srv')):
                    module = importlib.import_module(node.module)
                    known.update({item.name: getattr(module, item.name) for item in node.names})
            elif isinstance(node, ast.ClassDef) and any(
                    getattr(base, 'id', '') == Config.__name__ for base in node.bases):
                exec(compile(ast.Module([node], []), node.name, 'exec'), known)
        return known
