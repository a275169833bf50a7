"""Reads a submission: copies it, chooses its node, and finds the needs of the node: the packages of
the submission that it imports, and the modules that it lacks.

All this happens in a process of its own within limits: a file of a stranger may be made so that
reading it takes all memory, or hours. Then that process ends, not the marking.
"""
import ast
import json
import pkgutil
import re
import subprocess
import sys
from contextlib import suppress
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Tuple

from tb3_labs.marking.intake.archives import (
    IGNORED_PATHS, SUBMISSIONS_PER_CLASS_ZIP, NotJudged, UnpackLimits, digest, unpack)
from tb3_labs.marking.intake.find_node import find_node
from tb3_labs.marking.intake.packages import (
    MANIFEST, interface_files, modules_of, name_in, packages_in, source_of)
from tb3_labs.marking.intake.submissions import Submission, copy_submission
from tb3_labs.marking.names import NodeNames, is_name, is_typo_of

#: The most that a call may use: memory [bytes], processor time [s].
MEMORY, COMPUTING = 10 ** 9, 120
PROGRAM = '''import json, sys
del sys.path[0]
name, arguments = json.load(sys.stdin)
from tb3_labs.marking.intake import read_submission
try:
    answer = getattr(read_submission, name)(*arguments), None
except read_submission.NotJudged as problem:
    answer = None, str(problem)
json.dump(answer, sys.stdout)
'''
#: If a program catches one of these errors around an import, it runs without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^[ \t]*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: The message that the course gives: the skeletons have it, and this package.
GIVEN = 'MouseController'


class ParsedSubmission(NamedTuple):
    """A submission as it was read. Paths are relative to the folder of the copy."""

    digest: str                     # of all files of the copy
    remarks: List[str]              # sentences for the student; later steps add theirs
    look_at: List[str]              # sentences for the instructor, as well
    node: str                       # its file
    package: str                    # the folder of its package
    name: str                       # the name in the package's package.xml; '' if it has none
    bad_name: str                   # a sentence on a package.xml without a valid name
    packages: Dict[str, str]        # the needed ones: name -> folder
    given: List[str]                # packages that were not handed in, whose GIVEN it imports
    unused: List[str]               # modules that are not found, and not used, with dots


def read(submission: Submission, folder: Path, lab: NodeNames, package: str = '',
         name: str = '') -> ParsedSubmission:
    """The ParsedSubmission of a submission, copied into `folder`, which is made. `package`, `name`:
    of the node, if given. ``NotJudged`` if no file can be the node, or if it lacks modules."""
    files = {str(path): own_name for path, own_name in submission.files.items()}
    return ParsedSubmission(
        *_call('It cannot be read', _read, files, str(folder), lab, package, name))


def unpack_class(path: Path, folder: Path) -> List[str]:
    """Unpack the zip file of a class; remarks on what was left out. ``NotJudged`` if it must not
    be."""
    return _call('The zip file cannot be unpacked', _unpack_class, str(path), str(folder))


def _call(failure: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a function of this file, in a process of its own. Arguments and result pass as
    JSON. ``NotJudged`` if the function raises it; or if there is no result, most likely at a limit:
    its text begins with `failure`."""
    done = subprocess.run(
        ['prlimit', f'--as={MEMORY}', f'--cpu={COMPUTING}', '--core=0',
         sys.executable, '-c', PROGRAM],
        input=json.dumps([function.__name__, arguments]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # Python looks for modules in its folder
        start_new_session=True)     # Ctrl+C is for the marker
    if done.returncode != 0:
        words = done.stderr.strip().splitlines() or [f'exit status {done.returncode}']
        raise NotJudged('{}: reading it takes more than {:g} GB of memory or {:g} s, or failed '
                        '({}).'.format(failure, MEMORY / 1e9, COMPUTING, words[-1]))
    result, refusal = json.loads(done.stdout)
    if refusal is not None:
        raise NotJudged(refusal)
    return result


# -- in the limited process

def _unpack_class(path, folder):
    limits = UnpackLimits(SUBMISSIONS_PER_CLASS_ZIP)
    remarks = unpack(Path(path), Path(folder), limits, IGNORED_PATHS)
    if limits.exceeded:
        raise NotJudged(limits.exceeded)
    return remarks


def _read(files: Dict[str, str], folder: str, lab: Sequence[Any], package: str,
          name: str) -> ParsedSubmission:
    place, names = Path(folder), NodeNames(*lab)

    def has_node() -> bool:
        with suppress(NotJudged):
            return bool(find_node(place, names, package, name))
        return False
    remarks, unread = copy_submission({Path(path): own for path, own in files.items()}, place, has_node)
    unread = list(dict.fromkeys(unread))
    try:
        path, why, look_at = find_node(place, names, package, name)
    except NotJudged as problem:    # the node may be in what was not read
        raise NotJudged(' '.join((unread or [str(problem)]) + remarks)) from None
    node = place / path
    source, packages = source_of(node, place), packages_in(place, node)
    needed, given, unused, lacking, slips = _needs_of(node, packages)
    if 'rclpy' in lacking:
        raise NotJudged(f'{path} is a node of ROS 2: it imports rclpy. The labs have ROS 1: rospy.')
    if lacking:
        raise NotJudged(f'{path} imports {" and ".join(lacking)}, which neither the submission nor '
                        'the marking machine has.')
    misspelt = [f'{path} imports {name}, and there is no such module; near it: {near}.'
                for name, near in sorted(slips.items())]
    return ParsedSubmission(
        digest(place), remarks + why + unread + misspelt, look_at + misspelt, path,
        str(source.relative_to(place)), *name_in(source / MANIFEST),
        {name: str(packages[name].relative_to(place)) for name in needed}, given, unused)


# -- the imports of a program

class Import(NamedTuple):
    """The import of a module by a program."""

    module: str                 # with dots, as it is written
    names: Tuple[str, ...]      # of the module's content; () if the module itself is imported
    used: bool                  # is an imported name used?
    guarded: bool               # does the program go on if the import fails?

    @property
    def package(self) -> str:
        """The module up to its first dot."""
        return self.module.split('.')[0]


def imports_of(text: bytes) -> List[Import]:
    """Returns the imports of a program, in any order; [] if it is not valid Python, or too deep.

    Imports of the program's own package (``from . import x``) are left out.
    """
    try:
        nodes = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in nodes if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            found += [Import(alias.name, (), (alias.asname or alias.name.split('.')[0]) in used,
                             id(node) in guarded) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            bound = {alias.asname or alias.name for alias in node.names}
            found.append(Import(node.module, tuple(alias.name for alias in node.names),
                                bool(bound & {'*', *used}), id(node) in guarded))
    return found


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


def _needs_of(node, packages):
    """The needs of a node besides the system's modules; `packages`: name -> folder of all packages
    of the submission. The imports of the modules beside the node are read, too.

    Returns (names of the packages that it needs; missing packages of which it imports a GIVEN file;
    modules that are not found and not used, with dots; modules that are not found, up to their
    first dot; such a module -> the module that was probably meant).
    """
    needed, programs, own = [], [node], []
    made = {folder.name: name for name, package in packages.items()
            for folder in modules_of(package, name)}
    for program in programs:        # the list grows meanwhile
        found = imports_of(program.read_bytes())
        own += [item for item in found if not item.guarded] if program == node else []
        imported = sorted({item.package for item in found})
        for name in imported:       # this list too
            beside = node.parent / (name + '.py')
            if beside.is_file() and beside not in programs:
                programs.append(beside)
            package = name if name in packages else made.get(name)
            if package and package not in needed:
                needed.append(package)
                imported += sorted(_types_used(packages[package]))
                programs += [path for folder in modules_of(packages[package], package)
                             for path in sorted(folder.rglob('*.py'))]
    offered = {name for name, folder in packages.items() if any(
        interface_files(folder).values()) or (folder / 'setup.py').exists()}.union(made)
    missing = {name for name in {item.package for item in own} - offered
               if name not in sys.builtin_module_names
               and PathFinder.find_spec(name, [str(node.parent)] + sys.path) is None}
    given = {item.package for item in own
             if GIVEN in item.names and item.module.endswith('.msg') and item.package in missing
             and is_name(item.package) and item.package not in packages}
    slips = _slips(missing - given)
    missing -= given.union(slips)
    lacking = {item.package for item in own if item.used and item.package in missing}
    unused = {item.module for item in own if item.package in missing - lacking}
    return needed, sorted(given), sorted(unused), sorted(lacking), slips


def _slips(missing):
    """{name: module} of the names that are misspelt names of modules."""
    known = {each.name for each in pkgutil.iter_modules(sys.path)}.union(sys.builtin_module_names)
    return {name: near for name in missing for near in sorted(known)
            if len(near) > 3 and is_typo_of(name, near)}


def _types_used(package):
    """The packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))
