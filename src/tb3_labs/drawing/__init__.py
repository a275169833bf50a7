"""How is a robot drawn in a browser? The map of the live page and of the page of a recorded run."""
import re
from pathlib import Path

#: The folder of the map's program and colours.
FOLDER = Path(__file__).resolve().parent
IMPORT = re.compile(r"^import \{([^}]*)\} from '\./([\w.]+)';$", re.MULTILINE)
EXPORT = re.compile(r'^export (?=(?:class|function|const) (\w+))', re.MULTILINE)


def one_script(page: Path) -> str:
    """Returns one script with the program `page` and all its imports. If a page is a local file, a
    browser does not load modules for it. Each module becomes a function, so that two modules may
    use the same name.

    Imports look like ``import {a, b} from './c.js';`` and must not form a circle.
    """
    scripts = {}

    def add(path: Path) -> None:
        source = path.read_text(encoding='utf-8')
        for _, name in IMPORT.findall(source):
            beside_page = page.with_name(name)
            if name not in scripts:
                add(beside_page if beside_page.exists() else FOLDER / name)
        names = EXPORT.findall(source)
        body = EXPORT.sub('', IMPORT.sub(r"const {\1} = modules['\2'];", source))
        scripts[path.name] = (f"modules['{path.name}'] = (() => {{\n{body}\n"
                              f"return {{{', '.join(names)}}};\n}})();\n")

    add(page)
    return "'use strict';\nconst modules = {};\n" + ''.join(scripts.values())
