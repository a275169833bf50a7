"""How is a robot drawn in a browser? The live page and the page of a recorded run show one map."""
import re
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
IMPORT = re.compile(r"^import \{[^}]*\} from '\./([\w.]+)';$", re.MULTILINE)
EXPORT = re.compile(r'^export ', re.MULTILINE)


def one_script(page: Path) -> str:
    """Returns one script with the program in the file `page` and all modules that it
    imports. A browser cannot load modules for a page that is a local file. A module is a file
    beside `page`, or in FOLDER. Two files must not define the same name at the top level."""
    sources = {}

    def add_module(path: Path) -> None:
        source = path.read_text(encoding='utf-8')
        for name in IMPORT.findall(source):
            beside_page = page.with_name(name)
            if name not in sources:
                add_module(beside_page if beside_page.exists() else FOLDER / name)
        sources[path.name] = EXPORT.sub('', IMPORT.sub('', source))

    add_module(page)
    body = '\n'.join(sources.values())
    return f"(() => {{\n'use strict';\n{body}}})();\n"    # the script's names are not global
