"""doc/design.md names each room, and each file where it stands."""
import re

from pages import ROOT


def test_each_file_of_the_design_stands_in_the_folder_of_its_row():
    rows = 0
    for line in (ROOT / 'doc' / 'design.md').read_text(encoding='utf-8').splitlines():
        cells = line.split('|')
        if len(cells) == 5 and cells[1].strip().startswith('`') and '?' in cells[2]:
            rows += 1
            folders = re.findall(r'`([^`]+)/`', cells[1])
            for name in re.findall(r'`(\w+\.\w+)`', cells[3]):
                assert any((ROOT / folder / name).exists() for folder in folders), line
    assert rows >= 12


def test_the_design_has_a_row_for_each_room():
    page = (ROOT / 'doc' / 'design.md').read_text(encoding='utf-8')
    for room in (ROOT / 'src' / 'tb3_labs').iterdir():
        if (room / '__init__.py').exists():
            assert '| `src/tb3_labs/{}/` |'.format(room.name) in page
