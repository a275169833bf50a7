"""How is a robot drawn in a browser? The map of the live page and of the page of a recorded run."""
import re
from pathlib import Path

#: The folder of the map's program and colours.
FOLDER = Path(__file__).resolve().parent
IMPORT = re.compile(r"^import \{[^}]*\} from '\./([\w.]+)';$", re.MULTILINE)
EXPORT = re.compile(r'^export ', re.MULTILINE)


def one_script(page: Path) -> str:
    """Returns one script with the program `page` and all its imports, which are beside it or in
    FOLDER, since a browser loads no modules for a page that is a local file. A name at the top
    level of one file must not be in another."""
    sources = {}

    def add(path: Path) -> None:
        source = path.read_text(encoding='utf-8')
        for name in IMPORT.findall(source):
            beside_page = page.with_name(name)
            if name not in sources:
                add(beside_page if beside_page.exists() else FOLDER / name)
        sources[path.name] = EXPORT.sub('', IMPORT.sub('', source))

    add(page)
    body = '\n'.join(sources.values())
    return f"(() => {{\n'use strict';\n{body}}})();\n"    # no name is visible outside
