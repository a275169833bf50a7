"""A marker that forgets the instructor's own workspaces."""
from tb3_labs.marking.processes import forget_overlays


def workspace(folder, *packages):
    """A devel space; its path."""
    for name in packages:
        (folder / 'devel' / 'share' / name).mkdir(parents=True)
    (folder / 'devel' / '.catkin').write_text(str(folder / 'src'))
    return str(folder / 'devel')


def test_what_lies_over_this_package_is_forgotten_and_what_it_needs_stays(tmp_path):
    over = workspace(tmp_path / 'over', 'lab2')
    # in the other's source folder, as a clone in somebody's own workspace
    own = workspace(tmp_path / 'over' / 'src' / 'clone' / 'ws', 'tb3_labs')
    under = workspace(tmp_path / 'under', 'lab2')
    source = {prefix: prefix[:-len('devel')] + 'src' for prefix in (over, own, under)}
    environment = {
        'CMAKE_PREFIX_PATH': ':'.join((over, own, under)),
        'PYTHONPATH': ':'.join((over + '/lib/python3', own + '/lib/python3')),
        'ROS_PACKAGE_PATH': ':'.join((source[over], source[own], source[under])),
        'PATH': ':'.join((over + '/bin', own[:-len('devel')] + 'venv/bin', '/usr/bin')),
        'HOME': over}
    modules = ['', over + '/lib/python3', own + '/lib/python3']
    forget_overlays(environment, modules)
    assert environment == {
        'CMAKE_PREFIX_PATH': own + ':' + under,
        'PYTHONPATH': own + '/lib/python3',
        'ROS_PACKAGE_PATH': source[own] + ':' + source[under],
        'PATH': own[:-len('devel')] + 'venv/bin:/usr/bin',
        'HOME': over}
    assert modules == ['', own + '/lib/python3']


def test_without_such_workspaces_nothing_is_forgotten(tmp_path):
    own = workspace(tmp_path / 'own', 'tb3_labs')
    other = workspace(tmp_path / 'other', 'lab2')
    for prefixes in (own, own + ':' + other, other, ''):
        environment = {'CMAKE_PREFIX_PATH': prefixes, 'PYTHONPATH': other + '/lib/python3'}
        before, modules = dict(environment), [other + '/lib/python3']
        forget_overlays(environment, modules)
        assert (environment, modules) == (before, [other + '/lib/python3'])
