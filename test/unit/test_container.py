""".devcontainer/: what its two files and .dockerignore say fits together. No container is made here."""
import json
import re

import pytest
from pages import ROOT

FOLDER = ROOT / '.devcontainer'
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason='this copy has no container')


@pytest.fixture
def dockerfile():
    return (FOLDER / 'Dockerfile').read_text(encoding='utf-8')


@pytest.fixture
def editor():
    """devcontainer.json, without the comments that JSON itself does not have."""
    text = (FOLDER / 'devcontainer.json').read_text(encoding='utf-8')
    return json.loads(re.sub(r'^\s*//.*$', '', text, flags=re.MULTILINE))


def last(dockerfile, instruction):
    return re.findall('^{} (.*)$'.format(instruction), dockerfile, re.MULTILINE)[-1]


def test_a_mounted_clone_lies_where_the_image_was_built(dockerfile, editor):
    """Paths in build/.ws are absolute: elsewhere all would be built again."""
    place = last(dockerfile, 'WORKDIR')
    mounts = [dict(item.split('=', 1) for item in mount.split(','))
              for mount in [editor['workspaceMount'], *editor['mounts']]]
    assert editor['workspaceFolder'] == mounts[0]['target'] == place
    assert [mount['type'] for mount in mounts] == ['bind', 'volume', 'volume']
    assert mounts[1]['target'] == place + '/build'
    assert place + '/scripts/setup.sh' in last(dockerfile, 'ENTRYPOINT')
    assert '"{}/build/.ws/venv/bin/python3"'.format(place) in json.dumps(editor)


def test_nothing_runs_as_root_and_the_page_is_reached(dockerfile, editor):
    """The editor reaches the page without a token, docker with one."""
    assert last(dockerfile, 'USER') == editor['remoteUser'] == 'student'
    assert dockerfile.index('\nUSER ') < dockerfile.index('\nRUN ./scripts/setup.sh')
    assert 'ENV TB3_LABS_PANEL_ADDRESS=0.0.0.0\n' in dockerfile
    assert editor['containerEnv'] == {'TB3_LABS_PANEL_ADDRESS': '127.0.0.1'}
    assert editor['forwardPorts'] == [int(last(dockerfile, 'EXPOSE'))] == [8080]


def test_what_a_host_has_built_stays_out_of_the_image():
    ignored = (ROOT / '.dockerignore').read_text(encoding='utf-8').splitlines()
    assert {'build', '.git'} <= set(ignored)
    assert not {'.devcontainer', 'doc', 'test'} & set(ignored)
