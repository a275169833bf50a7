"""One name has one value: no constant of the cores' rooms has another value elsewhere."""
import ast
import pathlib
from collections import defaultdict

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The places of the names that are checked.
OURS = ('src/tb3_labs/localization/', 'src/tb3_labs/supervision/', 'src/tb3_labs/nodes/',
        'src/tb3_labs/control/settling.py')


def constants():
    """{name: {path: value in the source}} of all numbers in capitals at the top of a module."""
    found = defaultdict(dict)
    for path in sorted((ROOT / 'src').rglob('*.py')) + sorted((ROOT / 'scripts').glob('*.py')):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                name, text = node.targets[0].id, ast.dump(node.value)
                if name.isupper() and any(isinstance(part, ast.Constant) and isinstance(
                        part.value, (int, float)) for part in ast.walk(node.value)):
                    found[name][str(path.relative_to(ROOT))] = text
    return found


def test_a_name_has_one_value():
    ours = {name: places for name, places in constants().items()
            if any(path.startswith(OURS) for path in places)}
    assert len(ours) > 40
    assert {name: places for name, places in ours.items() if len(places) > 1} == {}
