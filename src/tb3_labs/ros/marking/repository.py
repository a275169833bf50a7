"""The packages of a submission, and which of them a node needs."""
import re
from pathlib import Path

from tb3_labs.marking.foreign import is_name
from tb3_labs.marking.imports import imports_of
from tb3_labs.ros.marking.submission import MANIFEST, files_in, name_in

#: The folders of a package's messages, services and actions; the names of their files end alike.
INTERFACES = ('msg', 'srv', 'action')
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^\s*([A-Za-z]\w*)/[A-Za-z]\w*(\[\d*\])?\s+\w')


def packages_in(folder, node):
    """name -> folder, of all packages below `folder`: those with a package.xml, and folders that
    hold message files without one. Of several with one name that nearest to `node` is taken. A name
    that a program cannot import is left out."""
    found = {}
    for path in files_in(folder):
        if path.name == MANIFEST:
            name, place = name_in(path)[0] or path.parent.name, path.parent
        elif path.parent.name in INTERFACES and path.suffix == '.' + path.parent.name:
            place = path.parent.parent
            if (place / MANIFEST).exists():
                continue
            name = place.name
        else:
            continue
        if is_name(name):
            found.setdefault(name, set()).add(place)

    def far(place):
        common = sum(1 for parent in place.parents if parent in node.parents)
        return -common, len(place.parts), str(place)
    return {name: min(places, key=far) for name, places in found.items()}


def interface_files(package):
    """kind ('msg', 'srv', 'action') -> names of the files of a package's folder; only kinds that
    there are. Their names may be anything."""
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES if any((package / kind).glob('*.' + kind))}


def types_used(package):
    """Names of the packages whose types the messages of a package's folder have as fields."""
    used = set()
    for kind, names in interface_files(package).items():
        for name in names:
            text = (package / kind / name).read_text(encoding='utf-8', errors='replace')
            for line in text.splitlines():
                field = FIELD.match(line)
                if field:
                    used.add(field.group(1))
                elif re.match(r'^\s*Header\s', line):
                    used.add('std_msgs')
    return used


def needed_by(node, packages):
    """Names of the packages that a node needs built, each after those that it needs itself.

    `packages`: name -> folder of all that there are.
    """
    order, seen = [], set()

    def visit(name):
        if name in seen or name not in packages:
            return
        seen.add(name)
        place = packages[name]
        for other in sorted(types_used(place)):
            visit(other)
        for path in sorted(place.glob('src/{}/**/*.py'.format(name))):
            for imported in imported_by(path):
                visit(imported)
        order.append(name)

    for path in [node] + neighbours(node):
        for imported in sorted(imported_by(path)):
            visit(imported)
    return order


def imported_by(path):
    """The modules that a program imports, up to their first dot."""
    text = Path(path).read_bytes().decode('utf-8-sig', errors='replace')    # Windows' first bytes
    return {name for item in imports_of(text) for name in item.packages}


def neighbours(node):
    """The modules beside a node that it imports, and that these import."""
    found, waiting = [], [node]
    while waiting:
        for name in sorted(imported_by(waiting.pop())):
            path = node.parent / (name + '.py')
            if path.is_file() and path != node and path not in found:
                found.append(path)
                waiting.append(path)
    return found
