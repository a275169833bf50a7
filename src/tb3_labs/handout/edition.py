"""The editions of this package: the same files, without those that an edition leaves out.

The instructor's edition is the repository. What another one leaves out stands in doc/edition.yaml,
as patterns with a reason. All that needs such a file follows. Paths are relative to the package's
folder, with slashes.
"""
import re
from pathlib import PurePosixPath
from typing import Dict, Iterable, Iterator, List, Mapping, NamedTuple, Sequence, Set, Tuple

from tb3_labs.handout.passages import anchors, for_students, without_links
from tb3_labs.handout.references import (
    INCLUDES, LINK, OWN_FILE, READ, SHOWS, Files, Reference, is_launch_file, is_program, linked,
    python_parts, references)

#: Files that people start or read; no other file needs to use them.
ENTRIES = re.compile(r'(src|scripts|doc/skeletons)/.*|.*\.(launch|test|md)|.*/test_\w+\.py|[^/]*')
#: Number of characters that are shown of a page's line.
QUOTED = 70
#: Programs and launch files of this package that a page tells to start.
TYPED = re.compile(r'\b(rosrun|roslaunch|rostest) tb3_labs ([\w-]+\.\w+)')
STARTED_FROM = {'rosrun': ('scripts',), 'roslaunch': ('launch',),
                'rostest': ('test/ros', 'test/marking')}


class Rules(NamedTuple):
    """What an edition leaves out: reason -> patterns; and the patterns of what it keeps."""

    left_out: Dict[str, List[str]]
    stays: List[str]

    def keeps(self, path: str) -> bool:
        """Must this file be in the edition?"""
        return any(matches(path, pattern) for pattern in self.stays)


def matches(path: str, pattern: str) -> bool:
    """Is this path meant? * stands for any part of a name, ** also for folders."""
    words = {'**': '.*', '*': '[^/]*'}
    return re.fullmatch(''.join(words.get(part, re.escape(part))
                                for part in re.split(r'(\*\*?)', pattern)), path) is not None


def rules_of(edition: str, settings: object) -> Rules:
    """The Rules of an edition in what doc/edition.yaml holds; ``ValueError`` if it holds none."""
    if not isinstance(settings, dict) or edition not in settings:
        raise ValueError('there is no edition {!r}: {}'.format(
            edition, ', '.join(settings) if isinstance(settings, dict) else 'the file is empty'))
    rules = settings[edition]
    if not isinstance(rules, dict) or set(rules) != {'left_out', 'stays'}:
        raise ValueError('edition {} must hold left_out and stays, and nothing else'.format(
            edition))
    lists = list(rules['left_out'].values()) if isinstance(rules['left_out'], dict) else [None]
    for patterns in lists + [rules['stays']]:
        if not (isinstance(patterns, list) and all(isinstance(item, str) for item in patterns)):
            raise ValueError('edition {}: left_out is lists of paths, each with its reason, and '
                             'stays is a list of paths'.format(edition))
    return Rules(rules['left_out'], rules['stays'])


def all_references(texts: Mapping[str, str]) -> Dict[str, List[Reference]]:
    """The References of each file. `texts`: path -> text, '' for a file that is no text."""
    files = Files(texts)
    return {path: references(path, text, files) for path, text in texts.items()}


def left_out(texts: Mapping[str, str], rules: Rules) -> Dict[str, str]:
    """path -> why, of each file that the edition leaves out.

    ``ValueError`` for a pattern without a file, and for a file that stays, but needs one that is
    left out.
    """
    gone: Dict[str, str] = {}
    for reason, patterns in rules.left_out.items():
        for pattern in patterns:
            found = [path for path in texts if matches(path, pattern)]
            if not found:
                raise ValueError('no file is called {}'.format(pattern))
            gone.update((path, reason) for path in found
                        if path not in gone and not rules.keeps(path))
    for pattern in rules.stays:
        if not any(matches(path, pattern) for path in texts):
            raise ValueError('no file is called {}'.format(pattern))
    needs = all_references(dict(texts, **{
        path: for_students(path, text) for path, text in texts.items()
        if path.endswith('.md') and path not in gone}))
    while _follow(gone, needs, rules):
        pass
    return gone


def _follow(gone: Dict[str, str], needs: Mapping[str, Sequence[Reference]], rules: Rules) -> bool:
    """Leave out what follows at once from `gone`; did anything?"""
    before, users = len(gone), _users(needs)
    lost_paths = gone.keys() | _folders(gone) - _folders(set(needs) - set(gone))
    for path, found in needs.items():
        if path in gone:
            continue
        lost = [reference for reference in found
                if reference.target in lost_paths and reference.verb != SHOWS]
        if lost:
            gone[path] = str(lost[0])
        elif not ENTRIES.fullmatch(path) and users.get(path) and users[path] <= set(gone):
            gone[path] = 'only {} uses it'.format(min(users[path]))
        if path in gone and rules.keeps(path):
            if not lost:
                del gone[path]    # it needs nothing that is missing
            else:
                raise ValueError('{} cannot stay: {}'.format(path, chain(path, gone)))
    return len(gone) > before


def _folders(paths: Iterable[str]) -> Set[str]:
    return {str(folder) + '/' for path in paths for folder in PurePosixPath(path).parents}


def _users(needs: Mapping[str, Sequence[Reference]]) -> Dict[str, Set[str]]:
    users: Dict[str, Set[str]] = {}
    for path, found in needs.items():
        for reference in found:
            if reference.verb != READ:
                users.setdefault(reference.target, set()).add(path)
    return users


def chain(path: str, gone: Mapping[str, str]) -> str:
    """Why a file is left out, from file to file: 'imports a.py, which starts b.py (a solution)'."""
    steps: List[str] = []
    while path in gone:
        verb, _, target = gone[path].partition(' ')
        if target not in gone:
            return '{} ({})'.format(', which '.join(steps), gone[path])
        steps.append('{} {}'.format(verb, target))
        path = target
    return ', which '.join(steps)


def made(texts: Mapping[str, str], gone: Mapping[str, str]) -> Dict[str, str]:
    """path -> text of the edition's files; its pages without what is the instructor's alone."""
    edition = {path: text for path, text in texts.items() if path not in gone}
    for path, text in edition.items():
        if path.endswith('.md'):
            edition[path] = without_links(path, for_students(path, text), gone.keys())
    return edition


def problems(edition: Mapping[str, str], gone: Mapping[str, str]) -> List[str]:
    """What the edition's files name and do not find: one line each, with its place."""
    found: List[str] = []
    lost = Files(gone)
    for path, text in edition.items():
        if is_program(path):
            found += ['{}:{}: imports {}, which is missing'.format(path, line, name)
                      for line, name in _own_imports(text) if lost.module(name, '')]
        elif is_launch_file(path):
            found += _lost_files(path, text, edition)
        elif path.endswith('.md'):
            found += _lost_words(path, text, edition, gone)
    return found


def _own_imports(text: str) -> Iterator[Tuple[int, str]]:
    """(line, module) of all that is imported from this package, also if it is no module."""
    for line, module, names in python_parts(text).imports:
        if module.split('.')[0] == 'tb3_labs':
            yield line, module
            yield from ((line, '{}.{}'.format(module, name)) for name in names)


def _lost_files(path: str, text: str, edition: Mapping[str, str]) -> List[str]:
    """The files of this package that a launch file names by their whole path."""
    return ['{}:{}: {} {}, which is missing'.format(path, _line(text, place), INCLUDES,
                                                    place.group(1))
            for place in OWN_FILE.finditer(text)
            if '.' in place.group(1).rpartition('/')[2] and place.group(1) not in edition]


def _lost_words(page: str, text: str, edition: Mapping[str, str],
                gone: Mapping[str, str]) -> List[str]:
    """Links that lead nowhere, and files that are left out, by their paths or as commands."""
    folders = {str(folder) for path in edition for folder in PurePosixPath(path).parents}
    found = []
    for link in LINK.finditer(text):
        target, (place, _, anchor) = linked(page, link.group(3)), link.group(3).partition('#')
        there = edition.get(target if place else page, '')
        if target and target not in edition and target not in folders or (
                anchor and not (place and not target) and anchor not in anchors(there)):
            found.append((link, link.group(3)))
    for typed in TYPED.finditer(text):
        command, name = typed.groups()
        if not any('{}/{}'.format(folder, name) in edition for folder in STARTED_FROM[command]):
            found.append((typed, name))
    names = sorted(gone, key=len, reverse=True)
    names += [path[len('src/tb3_labs/'):] for path in names if path.count('/') > 2
              and path.startswith('src/tb3_labs/')]
    for word in re.finditer(r'(?<![\w/])(?:\./)?({})(?!\w)'.format('|'.join(
            re.escape(name) for name in names if '/' in name)), text) if names else ():
        found.append((word, word.group(1)))
    return ['{}: names {}, which is not in the edition: {}'.format(
        page, name, _line_around(text, place)[:QUOTED])
            for place, name in sorted(found, key=lambda item: item[0].start())]


def _line_around(text: str, place: 're.Match[str]') -> str:
    """The line of the place: a page's line numbers are others without its marked passages."""
    begin = text.rfind('\n', 0, place.start()) + 1
    return text[begin:].partition('\n')[0].strip()


def _line(text: str, place: 're.Match[str]') -> int:
    return text.count('\n', 0, place.start()) + 1
