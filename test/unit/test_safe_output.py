"""A shell sources scripts/setup.sh. Workspaces of catkin stay, in any order, and also for an account
that does not own the installation. The packages that the set-up installs."""
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import zipfile

import pytest

from pages import ROOT as REPOSITORY, needs_setup
from sandboxes import skip_if_closed

pytestmark = pytest.mark.usefixtures('among_namesakes')
SETUP = REPOSITORY / 'scripts' / 'setup.sh'
BUILT = REPOSITORY / 'build' / '.ws'
DEVEL = BUILT / 'devel'
NOBODY = 65534


def shell(home, script, *wrapper, **variables):
    """Run `script` in a bash with a new environment. Returns (words of the output, errors)."""
    environment = dict({'PATH': '/usr/bin:/bin', 'HOME': str(home)}, **variables)
    done = subprocess.run(list(wrapper) + ['bash', '-c', script], env=environment, timeout=600.0,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return done.stdout.split(), done.stderr


def workspace(folder, python='/usr/bin/env python3', on_top_of=None):
    """Make a devel space as catkin_make does. Returns its path."""
    devel = folder / 'devel'
    devel.mkdir(parents=True)
    for name in ('setup.sh', 'setup.bash', 'local_setup.bash'):
        text = (DEVEL / name).read_text()
        (devel / name).write_text(text.replace(str(DEVEL), str(devel)))
    lines = (DEVEL / '_setup_util.py').read_text().split('\n')
    lines[0] = '#!' + python
    if on_top_of is not None:    # and on the workspaces below, such as /opt/ros/noetic
        number, = [number for number, line in enumerate(lines) if "CMAKE_PREFIX_PATH = r'" in line]
        lines[number] = lines[number].replace("r'", "r'{};".format(on_top_of))
    (devel / '_setup_util.py').write_text('\n'.join(lines))
    (devel / '_setup_util.py').chmod(0o755)
    (devel / '.catkin').write_text(str(folder / 'src'))
    return devel


SHOW = ('; echo "$CMAKE_PREFIX_PATH" "$ROS_PACKAGE_PATH" "$ROS_HOSTNAME" "$(command -v python3)" '
        '"$VIRTUAL_ENV" "$CMAKE_POLICY_VERSION_MINIMUM"')
#: The words of SHOW after the paths. With them a catkin_make in the terminal finds its Python.
OURS = ['localhost', str(BUILT / 'venv' / 'bin' / 'python3'), str(BUILT / 'venv'), '3.5']


@needs_setup
@pytest.mark.parametrize('order', ['{setup} {own}', '{own} {setup}', '{setup} {own} {setup}'])
def test_an_own_workspace_and_this_package_are_found_in_any_order(tmp_path, order):
    own = workspace(tmp_path / 'catkin_ws')    # built without tb3_labs
    files = order.format(setup=SETUP, own=own / 'setup.bash').split()
    words, errors = shell(tmp_path, 'set -e; ' + ' && '.join(
        'source ' + file for file in files) + SHOW)
    assert_both(own, words, errors)


@needs_setup
def test_a_workspace_on_top_of_this_one_needs_no_other_source(tmp_path):
    own = workspace(tmp_path / 'catkin_ws', on_top_of=DEVEL)
    words, errors = shell(tmp_path, 'source {}/setup.bash'.format(own) + SHOW + ' "$ROS_ETC_DIR"')
    assert words.pop() == str(BUILT / 'etc')
    assert_both(own, words, errors)
    paths, _ = shell(tmp_path, 'cd /; source {}/setup.bash; echo "$PYTHONPATH"'.format(own), PYTHONPATH=':/x::/y:')
    assert paths[0].split(':')[-2:] == ['/x', '/y'] and '' not in paths[0].split(':')


@needs_setup
@pytest.mark.parametrize('host, theirs', [
    ('localhost', '//etc/ros'), ('localhost', '/opt/ros/noetic/etc/ros'), ('robot', '//etc/ros')])
def test_a_local_master_has_no_rosout(tmp_path, host, theirs):
    """A workspace that was built without tb3_labs sets the system's ROS_ETC_DIR when it is sourced.
    `theirs` is the folder of Debian or Noetic."""
    words, errors = shell(tmp_path, 'sed s/^exec.*/env/ {}/venv/bin/roscore | sh'.format(BUILT),
                          ROS_ETC_DIR=theirs, ROS_HOSTNAME=host)
    etc = BUILT / 'etc' if host == 'localhost' else theirs
    assert errors == '' and 'ROS_ETC_DIR={}'.format(etc) in words
    assert 'rosout' not in (BUILT / 'etc' / 'roscore.xml').read_text()


def assert_both(own, words, errors):
    """The workspace `own` and this package's are on the paths."""
    assert errors == ''
    assert [word.split(':')[:2] for word in words[:2]] == [
        [str(own), str(DEVEL)], [str(own.parent / 'src'), str(BUILT / 'src')]]
    assert words[2:] == OURS


@needs_setup
@pytest.mark.parametrize('order', ['{own} {setup}', '{setup} {own}'])
def test_on_noetic_own_packages_are_found_in_any_order(tmp_path, order):
    """Noetic's hooks are in /opt/ros/noetic, and not in /etc. A folder takes its place."""
    noetic = workspace(tmp_path / 'noetic')
    (noetic / '.catkin').write_text('')
    hook = noetic / 'etc' / 'catkin' / 'profile.d' / '1.ros_package_path.sh'
    hook.parent.mkdir(parents=True)
    hook.write_text('export ROS_PACKAGE_PATH="$CMAKE_PREFIX_PATH"\n')
    own = workspace(tmp_path / 'catkin_ws', on_top_of=noetic)
    for devel in (own, noetic):    # Debian's catkin looks into /etc as well
        util = devel / '_setup_util.py'
        util.write_text(util.read_text().replace("    workspaces.append('/')\n", ''))
    files = order.format(setup=SETUP, own=own / 'setup.bash').split()
    words, errors = shell(tmp_path, 'set -e; ' + ' && '.join('source ' + file for file in files)
                          + '; echo $ROS_PACKAGE_PATH')
    assert errors == ''
    assert str(tmp_path / 'catkin_ws') in words[0] and str(BUILT) in words[0]


@needs_setup
def test_ros_2_a_conda_and_a_missing_folder_are_dropped_without_a_line(tmp_path):
    ros2, conda = tmp_path / 'humble', tmp_path / 'conda'
    for name in ('setup.bash', 'local_setup.bash', '_local_setup_util_sh.py'):
        ros2.mkdir(exist_ok=True)
        (ros2 / name).write_text('echo "it was sourced"; exit 1\n')
    shutil.copytree(str(workspace(tmp_path / 'ws')), str(conda))    # as a conda's ROS
    (conda / 'conda-meta').mkdir()
    gone = tmp_path / 'gone'
    words, errors = shell(
        tmp_path, 'source {}; echo "$CMAKE_PREFIX_PATH" "$PYTHONPATH"'.format(SETUP),
        CMAKE_PREFIX_PATH='{}:{}:{}'.format(ros2, conda, gone), ROS_DISTRO='humble',
        PYTHONPATH='{}/lib/python3.10/site-packages'.format(ros2))
    assert errors == ''
    assert words[0].split(':')[0] == str(DEVEL)
    assert not any(str(tmp_path) in word for word in words), words


@needs_setup
def test_a_fault_of_a_workspace_is_one_line(tmp_path):
    gone = workspace(tmp_path / 'gone_ws', '/nowhere/python3')
    python = tmp_path / 'python3'
    python.write_text('#!/bin/sh\ncase $1 in -c) exit 1;; *) exec /usr/bin/python3 "$@";; esac\n')
    python.chmod(0o755)
    poor = workspace(tmp_path / 'poor_ws', str(python))
    words, errors = shell(
        tmp_path, 'source {}; echo "$CMAKE_PREFIX_PATH"'.format(SETUP),
        CMAKE_PREFIX_PATH='{}:{}'.format(gone, poor))
    lines = errors.splitlines()
    assert len(lines) == 2, errors
    assert 'gone_ws' in lines[0] and 'rm -rf build devel && catkin_make' in lines[0]
    assert 'lacks rospy or squaternion' in lines[1] and 'cd {}'.format(tmp_path / 'poor_ws') in lines[1]
    assert words[0].split(':')[:2] == [str(poor), str(DEVEL)]


@needs_setup
@pytest.mark.parametrize('uri, problem', [
    ('http://robot3.invalid:11311', 'has a name that this computer cannot resolve'),
    ('robot3.invalid:11311', 'is not an address such as'), ('http://10.0.0.9:port', 'is not an address such as'),
    ('http://10.0.0.9:99999', 'is not an address such as'), ('http://255.255.255.255', 'cannot be reached (')])
def test_a_wrong_master_is_one_line_and_the_own_workspace_stays(tmp_path, uri, problem):
    own = workspace(tmp_path / 'catkin_ws')
    words, errors = shell(tmp_path, 'source {0}/setup.bash; source {1}; echo $?; export ROS_MASTER_URI=; '
                          'source {1}'.format(own, SETUP) + SHOW, ROS_MASTER_URI=uri)
    assert words.pop(0) == '1' and errors.count('\n') == 1
    assert errors.startswith('tb3_labs: ROS_MASTER_URI={} {}'.format(uri, problem))
    assert '. Do: export ROS_MASTER_URI=http://ADDRESS:11311, then' in errors
    assert_both(own, words, '')


@pytest.mark.skipif(not os.path.realpath('/bin/sh').endswith('dash'), reason='sh is not dash')
@pytest.mark.parametrize('call', ['. {}', 'sh {}'])
def test_another_shell_is_refused_in_one_line(tmp_path, call):
    """dash cannot read the rest of the file. A bash with the name sh can."""
    words, errors = shell(tmp_path, 'sh -c "{}"; echo $?'.format(call.format(SETUP)))
    assert (words, errors) == (['1'], 'tb3_labs: scripts/setup.sh needs bash; start one first\n')


def test_a_wrong_option_and_a_path_with_blanks_give_one_line(tmp_path):
    words, errors = shell(tmp_path, '{} --hlp || echo $?'.format(SETUP))
    assert words == ['2'] and 'unknown option --hlp' in errors and errors.count('\n') == 1
    place = tmp_path / 'my labs' / 'scripts'
    shutil.copytree(str(REPOSITORY / 'scripts'), str(place))
    words, errors = shell(tmp_path, '"{}/setup.sh"'.format(place))
    assert words == [] and errors.count('\n') == 1
    assert errors.endswith("move it, such as: mv '{}' ~/tb3_labs\n".format(place.parent))


@pytest.fixture
def room():
    """Returns (a copy of the set-up that another account owns, the home of `nobody`)."""
    if os.getuid() != 0 or not shutil.which('setpriv'):
        pytest.skip('only root can be another account')
    with tempfile.TemporaryDirectory() as folder:
        place, home = pathlib.Path(folder), pathlib.Path(folder, 'home')
        place.chmod(0o755)
        skip_if_closed(place)
        shutil.copytree(str(REPOSITORY / 'scripts'), str(place / 'room' / 'scripts'))
        (place / 'room' / 'build' / '.ws').mkdir(parents=True)
        home.mkdir()
        os.chown(str(home), NOBODY, NOBODY)
        yield place / 'room', home


AS_NOBODY = ('setpriv', '--reuid', str(NOBODY), '--regid', str(NOBODY), '--clear-groups')


def test_an_account_that_does_not_own_the_installation_has_logs_at_home(room):
    place, home = room
    words, errors = shell(home, 'CATKIN_ENV_HOOK_WORKSPACE={0}/build/.ws/devel; source {0}/scripts/setup/'
                          'terminal.bash; echo $ROS_HOME $ROS_LOG_DIR $HYPOTHESIS_STORAGE_DIRECTORY; '
                          'source {0}/scripts/setup.sh; echo $?'.format(place), *AS_NOBODY)
    assert words == [str(home / '.ros' / name) for name in ('', 'log', 'hypothesis')] + ['1']
    assert errors.startswith('tb3_labs: root, whose installation this is, must run ') and errors.count('\n') == 1


#: Sources the part of the set-up that knows packages, with the variables of scripts/setup.sh.
PACKAGES = ('fail() {{ echo "$*" >&2; exit 1; }}; say() {{ echo "$*"; }}; system={system}; '
            'source {repository}/scripts/setup/packages.sh; find_ros {folder}; name_packages; ')


def packages(folder, script, system='debian:12'):
    """Run `script` after PACKAGES. `folder` takes the place of /opt/ros. See :func:`shell`."""
    return shell(folder, PACKAGES.format(system=system, repository=REPOSITORY, folder=folder) + script)


def test_without_sudo_the_line_for_root_is_printed(room):
    place, home = room
    script = PACKAGES.format(system='debian:12', repository=place, folder=home)
    words, errors = shell(home, script + 'missing=(make g++); command() { false; }; install_packages', *AS_NOBODY)
    assert words == [] and errors.count('\n') == 1
    assert errors.endswith("su - -c 'apt-get update; apt-get install --no-install-recommends make g++'\n")


@pytest.mark.parametrize('name', ['noetic', 'humble'])
def test_a_noetic_beside_the_system_is_found(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / name / 'setup.bash').touch()
    words, errors = packages(tmp_path, 'echo "[$ros]" "${run_packages[@]}"')
    found = name == 'noetic'
    assert (words[0], errors) == ('[{}]'.format(tmp_path / name if found else ''), '')
    assert found == ('ros-noetic-tf' in words) == ('python3-rospy' not in words)


@pytest.mark.parametrize('system, problem', [
    ('debian:13', ''), ('debian:11', ''), ('ubuntu:22.04', ''),
    ('ubuntu:20.04', 'ROS Noetic is missing'), ('ubuntu:24.04', 'docker build'),
    ('debian:10', 'it takes Debian 13, 12 and 11'), ('unknown', 'docker build')])
def test_a_system_without_ros_1_is_refused_in_one_line(tmp_path, system, problem):
    words, errors = packages(tmp_path, 'refuse_system; echo accepted', system)
    assert words == ([] if problem else ['accepted'])
    assert problem in errors and errors.count('\n') == bool(problem)


#: An apt with the answer of apt-get 2.6 and 3.0 to `update`. It reports each installation.
APT = """ws={folder} log={folder}/log missing=(catkin)
sudo() {{ :; }}; as_root() {{ :; }}; fail_log() {{ fail "$*"; }}
apt() {{ case "$*" in update*) printf '%s\n' {update} ;; *) echo installed >&2 ;; esac; }}
install_packages"""
REFUSED = "'Err:1 http://mirror/debian trixie InRelease' " \
    "'W: Failed to fetch http://mirror/debian/InRelease  Temporary failure'"


@pytest.mark.parametrize('update, is_tried', [
    (REFUSED, False), (REFUSED + " 'Hit:2 http://other/debian trixie InRelease'", True),
    ("'Get:1 http://mirror/debian trixie InRelease'", True)])
def test_without_a_network_nothing_is_tried(tmp_path, update, is_tried):
    words, errors = packages(tmp_path, APT.format(folder=tmp_path, update=update))
    assert ('installing' in words) == is_tried
    problem = 'the network is missing: http://mirror/debian/InRelease cannot be reached\n'
    assert errors == ('' if is_tried else problem)


#: A wheel of this name and version that is not PyPI's.
FORGED = {'squaternion.py': '"harm"', 'squaternion-{0}.dist-info/METADATA': 'Metadata-Version: 2.1\n'
          'Name: squaternion\nVersion: {0}\n', 'squaternion-{0}.dist-info/RECORD': '',
          'squaternion-{0}.dist-info/WHEEL': 'Wheel-Version: 1.0\nRoot-Is-Purelib: true\n'
          'Tag: py3-none-any\n'}


def forge(folder, version):
    """Write the FORGED wheel into a folder. Returns its path."""
    path = folder / 'squaternion-{}-py3-none-any.whl'.format(version)
    with zipfile.ZipFile(str(path), 'w') as wheel:
        for name, text in FORGED.items():
            wheel.writestr(name.format(version), text.format(version))
    return path


@needs_setup
def test_a_second_copy_needs_no_network_and_completes_a_set_up_that_failed(tmp_path):
    copy, cache = tmp_path / 'copy', tmp_path / 'cache' / 'tb3_labs'
    shutil.copytree(str(REPOSITORY / 'scripts'), str(copy / 'scripts'))
    for name in 'package.xml', 'CMakeLists.txt', 'setup.py', 'msg/A.msg', 'srv/A.srv':
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).touch()
    wheel = forge(tmp_path, '1.0.0')
    (copy / 'scripts/setup/requirements.txt').write_text('squaternion==1.0.0 --hash=sha256:{}\n'.format(
        hashlib.sha256(wheel.read_bytes()).hexdigest()))
    # the mouse's package is not forged, and a build would take seconds
    listed, setup = copy / 'scripts/setup/packages.sh', copy / 'scripts/setup.sh'
    listed.write_text(listed.read_text().replace('requirements+=(pynput)', '') + 'catkin_make() { :; }\n')
    text = setup.read_text()
    assert 'without_pip=();' in text    # the system's pip takes seconds less than a new one
    setup.write_text(text.replace('without_pip=();', 'mkdir -p "$ws/venv/bin"; touch "$ws/venv/bin/pip";'))
    offline = {'XDG_CACHE_HOME': str(cache.parent), 'PIP_INDEX_URL': 'http://127.0.0.1:9/simple',
               'PIP_RETRIES': '0'}
    _, errors = shell(tmp_path, str(setup), **offline)
    assert 'the network is missing, or PyPI: squaternion' in errors
    wheel.rename(cache / wheel.name)     # an earlier set-up of this user leaves it there
    _, errors = shell(tmp_path, str(setup), **offline)
    assert errors == ''
    programs = copy / 'build' / '.ws' / 'venv' / 'bin'
    assert (programs / 'dynparam').exists()
    assert shell(tmp_path, '{}/python3 -Ic "import squaternion; print(squaternion.__file__)"'.format(
        programs))[0][0].startswith(str(copy))


@needs_setup
def test_pip_installs_only_the_files_that_the_repository_names(tmp_path):
    lines = (REPOSITORY / 'scripts/setup/requirements.txt').read_text().splitlines()
    pins = [line for line in lines if not line.startswith('#')]
    assert all(re.search(r'==[\d.]+ .*--hash=sha256:[0-9a-f]{64}$', pin) for pin in pins)
    versions = re.findall(r'squaternion==(\S+)', ' '.join(pins))
    for version in versions:
        forge(tmp_path, version)
    words, errors = packages(tmp_path, 'repo={}; pinned; {}/venv/bin/python3 -Im pip --isolated '
                             'install --quiet --no-index --find-links {folder} --target {folder}/out '
                             '"${{pip_exactly[@]}}" -r <(pinned)'.format(
                                 REPOSITORY, BUILT, folder=tmp_path))
    assert len(versions) == 2 and 'DO NOT MATCH THE HASHES' in errors and not (tmp_path / 'out').exists()
