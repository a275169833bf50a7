"""package.xml and CHANGELOG.rst, as catkin's release tools read them."""
import pathlib
import re
import xml.etree.ElementTree as ET

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_the_changelogs_newest_version_is_the_packages():
    lines = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8').splitlines()
    headings = [text for text, rule in zip(lines, lines[1:]) if rule and rule == '-' * len(text)]
    assert 'Forthcoming' not in headings[1:]
    released = [re.match(r'(\d+\.\d+\.\d+) \(\d{4}-\d\d-\d\d\)$', text)
                for text in headings if text != 'Forthcoming']
    assert released and all(released)    # a malformed heading would be lost to catkin's tools
    assert ET.parse(str(ROOT / 'package.xml')).getroot().findtext('version') == released[0].group(1)
