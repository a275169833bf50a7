"""What does a file of this package need? Files that it imports, starts, includes or shows.

Paths are relative to the package's folder, with slashes. Names that are put together while a
program or a launch file runs are not followed: $(arg lab).launch.
"""
import ast
import re
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Dict, Iterable, Iterator, List, NamedTuple, Set, Tuple

#: Folders of programs that rosrun, roslaunch and rostest find by their names.
PROGRAMS = ('scripts', 'test/ros', 'test/marking')
#: Folders of modules that a program or a test imports by their bare names, beside its own folder.
MODULES = ('test', 'test/benchmark')
#: In this folder a text that names a program or a launch file starts it;
STARTS = 'test/ros'
#: in these a text that is the name of a file or folder reads it.
READS = ('test', 'test/unit')
IMPORTS, STARTED, INCLUDES, READ, SHOWS = 'imports', 'starts', 'includes', 'reads', 'shows'

XML_COMMENT = re.compile(r'<!--.*?-->', re.S)
NODE = re.compile(r'<(?:node|test)\b[^>]*>', re.S)
OWN_TYPE = re.compile(r'\bpkg\s*=\s*"tb3_labs"'), re.compile(r'\btype\s*=\s*"([^"$]+)"')
#: The file that .run_test.py runs, and a module that a command runs.
TEST_FILE, MODULE = re.compile(r'args="(?:ros|marking)/([\w.]+)"'), re.compile(r'-m (tb3_labs[\w.]+)')
OWN_FILE = re.compile(r'\$\(find tb3_labs\)/([\w./-]+)')
PROGRAM_NAME = re.compile(r'[\w-]+\.(?:py|launch|test|sh)\b')
#: A link of Markdown: is it an image, its text, its target.
LINK = re.compile(r'(!?)\[([^\]]*)\]\(([^)\s]+)\)')


class Reference(NamedTuple):
    """One file needs another: `verb` says how, `target` is its path; a folder's ends in a slash."""

    verb: str
    target: str

    def __str__(self) -> str:
        return '{} {}'.format(self.verb, self.target)


class Files:
    """The files of the package, found by the names that other files give them."""

    def __init__(self, paths: Iterable[str]) -> None:
        self.paths = frozenset(paths)
        self._named: Dict[str, Set[str]] = {}
        folders = {str(folder) + '/' for path in self.paths
                   for folder in list(PurePosixPath(path).parents)[:-1]}
        for path in self.paths | folders:
            self._named.setdefault(PurePosixPath(path).name, set()).add(path)

    def programs(self, name: str) -> List[str]:
        """The programs with this name, as rosrun would find them."""
        return [path for path in ('{}/{}'.format(folder, name) for folder in PROGRAMS)
                if path in self.paths]

    def started_as(self, name: str) -> List[str]:
        """The programs and launch files that a rostest may mean by this name."""
        return sorted(path for path in self._named.get(name, ())
                      if path.startswith(PROGRAMS + ('launch/',)))

    def read_as(self, name: str) -> List[str]:
        """The files that a test may mean by this name, or by this end of a path; of folders those
        of STARTS alone, since a room's name is a common word."""
        end = '/' + name
        return sorted(path for path in self._named.get(name.rpartition('/')[2], ())
                      if ('/' + path).rstrip('/').endswith(end) and not path.startswith('src/')
                      and (not path.endswith('/') or path.startswith(STARTS + '/')))

    def module(self, name: str, beside: str) -> str:
        """The file of a module that is imported by a file in the folder `beside`, or ''."""
        words = name.split('.')
        if words[0] == 'tb3_labs':
            places = ['src/' + '/'.join(words)]
        elif len(words) == 1:
            places = ['{}/{}'.format(folder, name) for folder in (beside,) + MODULES]
        else:
            places = []
        for place in places:
            for path in (place + '.py', place + '/__init__.py'):
                if path in self.paths:
                    return path
        return ''


def is_program(path: str) -> bool:
    """Is it Python of this package? The skeletons' Python is a text to be filled."""
    return path.endswith('.py') and path.startswith(('src/', 'scripts/', 'test/'))


def is_launch_file(path: str) -> bool:
    """Is it a launch file, a rostest, or a skeleton of one?"""
    return path.endswith(('.launch', '.test', '.launch.in'))


def references(path: str, text: str, files: Files) -> List[Reference]:
    """The References of a file of this text; ``ValueError`` if its Python is none."""
    folder = str(PurePosixPath(path).parent)
    found: List[Reference] = []
    if is_program(path):
        try:
            imported, texts = python_parts(text)
        except SyntaxError as problem:
            raise ValueError('{}:{}: {}'.format(path, problem.lineno, problem.msg)) from None
        for _, module, names in imported:
            found += [Reference(IMPORTS, files.module(name, folder)) for name in (
                module, *('{}.{}'.format(module, name) for name in names))]
        if folder == STARTS:
            found += [Reference(STARTED, target) for text in texts
                      for name in PROGRAM_NAME.findall(text) for target in files.started_as(name)]
        elif folder in READS:
            found += [Reference(READ, target) for text in texts for target in files.read_as(text)]
    elif is_launch_file(path):
        found = list(_of_launch_file(XML_COMMENT.sub('', text), files))
    elif path.endswith('.md'):
        found = [Reference(SHOWS, target) for target in (
            linked(path, link.group(3)) for link in LINK.finditer(text)) if target in files.paths]
    return [reference for reference in dict.fromkeys(found) if reference.target not in ('', path)]


class PythonParts(NamedTuple):
    """(line, module, names taken from it) of each import; all texts, without the docstrings."""

    imports: Tuple[Tuple[int, str, Tuple[str, ...]], ...]
    texts: Tuple[str, ...]


@lru_cache(maxsize=None)
def python_parts(source: str) -> PythonParts:
    """The PythonParts of a source; ``SyntaxError`` if it is none."""
    imports: List[Tuple[int, str, Tuple[str, ...]]] = []
    texts: Dict[int, str] = {}
    docstrings: Set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imports += [(node.lineno, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            imports.append((node.lineno, node.module, tuple(a.name for a in node.names)))
        elif isinstance(node, ast.Expr):
            docstrings.add(id(node.value))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts[id(node)] = node.value
    return PythonParts(tuple(imports), tuple(
        text for place, text in texts.items() if place not in docstrings))


def _of_launch_file(text: str, files: Files) -> Iterator[Reference]:
    text = text.replace('$(dirname)', '$(find tb3_labs)/launch')
    for module in MODULE.findall(text):
        yield Reference(STARTED, files.module(module, ''))
    for name in TEST_FILE.findall(text):
        for program in files.programs(name):
            yield Reference(STARTED, program)
    for tag in NODE.findall(text):
        own, kind = (pattern.search(tag) for pattern in OWN_TYPE)
        if own and kind:
            for program in files.programs(kind.group(1)):
                yield Reference(STARTED, program)
    for target in OWN_FILE.findall(text):
        if target in files.paths:
            yield Reference(INCLUDES, target)


def linked(page: str, target: str) -> str:
    """The path to which a link of a page leads, without its anchor; '' for one that leads to the
    page itself, or out of the package."""
    target = target.partition('#')[0]
    if not target or ':' in target:
        return ''
    parts: List[str] = []
    for part in (PurePosixPath(page).parent / target).parts:
        if part == '..':
            parts = parts[:-1]
        else:
            parts.append(part)
    return '/'.join(parts)
