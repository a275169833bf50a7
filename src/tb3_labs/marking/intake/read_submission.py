"""Reads a submission: copies it, chooses its node, and finds the packages that the node needs and
the modules that are missing.

This happens in a process of its own, with limits: a stranger's file may be made so that reading it
takes all memory, or hours. Then that process ends, and the marking goes on.
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

#: The limits of that process: memory [bytes], processor time [s].
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
#: A program that catches one of these errors around an import runs without the module.
IMPORT_ERRORS = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^[ \t]*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: The message that the course gives to the students. The skeletons have it, and this package.
COURSE_MESSAGE = 'MouseController'


class ParsedSubmission(NamedTuple):
    """A submission as it was read. Paths are relative to the folder of the copy."""

    digest: str                     # of all files of the copy
    remarks: List[str]              # sentences for the student; later steps add more
    findings: List[str]             # sentences for the instructor; later steps add more
    node: str                       # the node's file
    package: str                    # the folder of its package
    name: str                       # the name in the package's package.xml; '' if it is not valid
    bad_name: str                   # the reason if the name is not valid, a sentence
    packages: Dict[str, str]        # the packages that the node needs: name -> folder
    substituted: List[str]          # missing packages from which it imports the COURSE_MESSAGE
    unused: List[str]               # missing modules that the node imports and does not use


def read(submission: Submission, folder: Path, lab: NodeNames, package: str = '',
         name: str = '') -> ParsedSubmission:
    """Copy a submission into `folder`, which is made, and read it. If `package` or `name` is given,
    the node has that package or name.

    Raises ``NotJudged`` if no file can be the node, or if the node uses a missing module.
    """
    files = {str(path): own_name for path, own_name in submission.files.items()}
    return ParsedSubmission(
        *_in_limited_process('It cannot be read', _read, files, str(folder), lab, package, name))


def unpack_class(path: Path, folder: Path) -> List[str]:
    """Unpack the zip file of a class. Returns remarks on files that are left out. ``NotJudged`` if
    it is not a zip file, exceeds a limit, or is not safe."""
    return _in_limited_process(
        'The zip file cannot be unpacked', _unpack_class, str(path), str(folder))


def _in_limited_process(failure: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of this file in a process of its own, and return its result. Arguments and
    result are sent as JSON.

    Raises ``NotJudged`` if the function raises it, or if the process ends without a result. Then a
    limit is the likely cause, and the text begins with `failure`.
    """
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
    copy, names = Path(folder), NodeNames(*lab)

    def has_node() -> bool:
        with suppress(NotJudged):
            return bool(find_node(copy, names, package, name))
        return False
    remarks, not_unpacked = copy_submission(
        {Path(path): own_name for path, own_name in files.items()}, copy, has_node)
    not_unpacked = list(dict.fromkeys(not_unpacked))
    try:
        path, why, findings = find_node(copy, names, package, name)
    except NotJudged as problem:    # the node may be in what was not unpacked
        raise NotJudged(' '.join((not_unpacked or [str(problem)]) + remarks)) from None
    node = copy / path
    source, packages = source_of(node, copy), packages_in(copy, node)
    needs = _needs_of(node, packages)
    if 'rclpy' in needs.missing:
        raise NotJudged(f'{path} is a node of ROS 2: it imports rclpy. The labs have ROS 1: rospy.')
    if needs.missing:
        raise NotJudged(f'{path} imports {" and ".join(needs.missing)}, which neither the '
                        'submission nor the marking machine has.')
    misspelt = [f'{path} imports {name}, and there is no such module; near it: {near}.'
                for name, near in sorted(needs.misspelt.items())]
    return ParsedSubmission(
        digest(copy), remarks + why + not_unpacked + misspelt, findings + misspelt, path,
        str(source.relative_to(copy)), *name_in(source / MANIFEST),
        {name: str(packages[name].relative_to(copy)) for name in needs.packages},
        needs.substituted, needs.unused)


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
    """Returns the imports of a program; [] if it is not valid Python, or nested too deeply.

    Imports from the program's own package (``from . import x``) are left out.
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
        isinstance(node, ast.Name) and node.id in IMPORT_ERRORS for node in ast.walk(handler.type))


class _Needs(NamedTuple):
    """The needs of a node besides the system's modules."""

    packages: List[str]         # packages of the submission
    substituted: List[str]      # missing packages from which it imports the COURSE_MESSAGE
    unused: List[str]           # missing modules that it does not use, with dots
    missing: List[str]          # missing modules that it uses
    misspelt: Dict[str, str]    # missing module -> the module that was probably meant


def _needs_of(node, packages):
    """Returns the _Needs of a node. `packages` has name -> folder of the submission's packages."""
    module_package = {folder.name: name for name, package in packages.items()
                      for folder in modules_of(package, name)}
    imports = [item for item in imports_of(node.read_bytes()) if not item.guarded]
    available = {name for name, folder in packages.items() if any(
        interface_files(folder).values()) or (folder / 'setup.py').exists()}.union(module_package)
    missing = {name for name in {item.package for item in imports} - available
               if name not in sys.builtin_module_names
               and PathFinder.find_spec(name, [str(node.parent)] + sys.path) is None}
    substituted = {
        item.package for item in imports
        if COURSE_MESSAGE in item.names and item.module.endswith('.msg')
        and item.package in missing and is_name(item.package) and item.package not in packages}
    misspelt = _misspelt(missing - substituted)
    missing -= substituted.union(misspelt)
    used = {item.package for item in imports if item.used and item.package in missing}
    unused = {item.module for item in imports if item.package in missing - used}
    return _Needs(_needed_packages(node, packages, module_package), sorted(substituted),
                  sorted(unused), sorted(used), misspelt)


def _needed_packages(node, packages, module_package):
    """Returns the names of the packages that a node needs. The imports of the modules beside the
    node and of those packages are read, too."""
    needed, programs = [], [node]
    for program in programs:        # the list grows meanwhile
        names = sorted({item.package for item in imports_of(program.read_bytes())})
        for name in names:          # this list grows, too
            beside = node.parent / (name + '.py')
            if beside.is_file() and beside not in programs:
                programs.append(beside)
            package = name if name in packages else module_package.get(name)
            if package and package not in needed:
                needed.append(package)
                names += sorted(_packages_of_types(packages[package]))
                programs += [path for folder in modules_of(packages[package], package)
                             for path in sorted(folder.rglob('*.py'))]
    return needed


def _misspelt(missing):
    """Returns {name: module} for the missing names that differ from a module by a typing error."""
    known = {each.name for each in pkgutil.iter_modules(sys.path)}.union(sys.builtin_module_names)
    return {name: near for name in missing for near in sorted(known)
            if len(near) > 3 and is_typo_of(name, near)}


def _packages_of_types(package):
    """Returns the packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))
