"""The files of .devcontainer fit together. No container is made."""
import json
import re

import pytest
from pages import ROOT

FOLDER = ROOT / '.devcontainer'
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason='this copy has no container')


def test_the_two_files_and_the_list_of_ignored_files_fit_together():
    dockerfile = (FOLDER / 'Dockerfile').read_text(encoding='utf-8')
    comment = re.compile(r'^\s*//.*$', re.MULTILINE)
    editor = json.loads(comment.sub('', (FOLDER / 'devcontainer.json').read_text(encoding='utf-8')))
    # the instructions of the last stage
    last = dict(re.findall('^([A-Z]+) (.*)$', dockerfile, re.MULTILINE))
    mounts = [dict(item.split('=', 1) for item in mount.split(','))
              for mount in [editor['workspaceMount'], *editor['mounts']]]
    # build/.ws has absolute paths, and would be built again in another folder
    place = last['WORKDIR']
    assert editor['workspaceFolder'] == mounts[0]['target'] == place
    assert [mount['type'] for mount in mounts] == ['bind', 'volume', 'volume']
    assert mounts[1]['target'] == place + '/build'
    assert place + '/scripts/setup.sh' in last['ENTRYPOINT']
    assert '"{}/build/.ws/venv/bin/python3"'.format(place) in json.dumps(editor)
    # nothing runs as root; the editor reaches the page without a token, docker with one
    assert last['USER'] == editor['remoteUser'] == 'student'
    assert dockerfile.index('\nUSER ') < dockerfile.index('\nRUN ./scripts/setup.sh')
    assert 'ENV TB3_LABS_PANEL_ADDRESS=0.0.0.0\n' in dockerfile
    assert editor['containerEnv'] == {'TB3_LABS_PANEL_ADDRESS': '127.0.0.1'}
    assert editor['forwardPorts'] == [int(last['EXPOSE'])] == [8080]
    ignored = (ROOT / '.dockerignore').read_text(encoding='utf-8').splitlines()
    assert {'build', '.git'} <= set(ignored) and not {'.devcontainer', 'doc', 'test'} & set(ignored)
