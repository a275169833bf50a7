"""How is a robot drawn in a browser? The map of the live page and of the page of a recorded run."""
import re
from pathlib import Path

#: The folder of the map's program and colours.
FOLDER = Path(__file__).resolve().parent
#: The modules of the folder, each after the modules that it imports.
MODULES = 'drawing.js', 'map.js'
#: An import, or the word `export` in front of a definition.
MODULE_SYNTAX = re.compile(r"^import \{[^}]*\} from '[^']*';$|^export ", re.MULTILINE)


def one_script(page: Path) -> str:
    """Returns one script with the MODULES and the program `page`, since a browser loads no modules
    for a page that is a local file. A name at the top level of one file must not be in another."""
    paths = [FOLDER / name for name in MODULES] + [page]
    sources = [path.read_text(encoding='utf-8') for path in paths]
    return "'use strict';\n" + MODULE_SYNTAX.sub('', '\n'.join(sources))
