"""Names that learning platforms give to submissions, and the unpacking of archives."""
import os
import pathlib
import shutil
import tempfile
import zipfile

import pytest

from sandboxes import hand_in, skip_if_closed
from tb3_labs.marking.intake import archives, read_submission
from tb3_labs.marking.intake.archives import DEEPEST, NotJudged, UnpackLimits, digest, submitted_files, unpack
from tb3_labs.marking.intake.submissions import (
    PlatformName, Submission, by_student, file_name, copy_submission, read_name, submissions_in, without_wrapping)

NODE = 'lab2/scripts/turtlebot_controller.py'


# -- names

@pytest.mark.parametrize('name, is_folder, said', [
    ('Ann Miller_12345_assignsubmission_file_', True, ('Ann Miller', '12345', '')),
    ('Ann-Li de Groot_7_assignsubmission_file_my_work.zip', False,
     ('Ann-Li de Groot', '7', 'my_work.zip')),
    ('millerann_LATE_12345_67890_lab2.zip', False, ('millerann', '12345', 'lab2.zip', True)),
    ('millerann_late_12345_67890_lab_2-3.zip', False, ('millerann', '12345', 'lab_2.zip', True)),
    ('miller.ZIP', False, ('miller', '', 'miller.ZIP')),
    ('miller_2_3_lab2', True, ('miller_2_3_lab2', '', '')),
    ('late_miller', True, ('late_miller', '', ''))])
def test_a_name_says_whose_it_is(name, is_folder, said):
    assert read_name(name, is_folder) == PlatformName(*said)


def test_files_of_one_student_belong_together_and_namesakes_do_not():
    names = ['lee_1_11_a.py', 'lee_1_12_b.msg', 'lee_2_13_a.py', 'kim_3_14_a.zip', 'kim.zip', 'kim']
    assert by_student({name: read_name(name, '.' not in name) for name in names}) == {
        'lee (1)': ['lee_1_11_a.py', 'lee_1_12_b.msg'], 'lee (2)': ['lee_2_13_a.py'],
        'kim (3)': ['kim_3_14_a.zip'], 'kim (kim.zip)': ['kim.zip'], 'kim (kim)': ['kim']}


#: Names that break rules of file systems or programs.
NASTY = ['"><script>', "O'Hara; rm -rf ~", 'two\nlines', '\x1b[2Jann', '.._', '...', 'x' * 255,
         '\u202egnp.exe', '\u05d0\u05d1\u05d2', os.fsdecode(b'M\xfcller'), '=cmd|calc!A1',
         'overview', 'ann.marks', ' ', 'a\\b', os.fsdecode(b'\xff' * 255)]


def test_every_name_becomes_a_different_one_that_files_and_lines_can_have():
    for name in NASTY:
        made = file_name(name)
        assert made.isprintable() and '/' not in made and len(made.encode()) < 200
        assert file_name(made) == made and made not in ('', '.', '..', 'overview')
    for name in ('Ann-Li de Groot', 'M\xfcller', 'kim (2)', '\u05d0'):
        assert file_name(name) == name
    assert file_name(os.fsdecode(b'M\x80\xff')) == 'M\\x80\\xff'
    names = NASTY + ['M\\xfcller', 'M\\xfcller_', 'x' * 254, '..', 'Ann', 'Ann ']
    found = by_student({name: read_name(name, True) for name in names})
    assert sorted(name for name, in found.values()) == sorted(names)


# -- archives

def zipped(path, files, **changes):
    """Write a zip file. `files` has name -> text, or the pairs (name, text). Returns the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(str(path), 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items() if isinstance(files, dict) else files:
            info = zipfile.ZipInfo(name, changes.get('date', (2026, 11, 20, 12, 0, 0)))
            info.external_attr = changes.get('mode', 0o644) << 16
            archive.writestr(info, text, zipfile.ZIP_DEFLATED)
    return path


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file()}


def test_what_is_nobodys_work_is_not_unpacked(tmp_path):
    """A link is not unpacked. Windows writes backslashes into a path."""
    path = zipped(tmp_path / 'a.zip', {
        'a/' + NODE: 'x', '__MACOSX/a/._x.py': 'x', 'a/.DS_Store': 'x', 'a/run.bag': 'x',
        'a/.git/config': 'x', 'a/build/x.py': 'x', 'a/builder.py': 'x', 'a\\b\\c.py': 'x'},
        mode=0o755)
    link = zipped(tmp_path / 'b.zip', {'passwd': '/etc/passwd'}, mode=0o120777)
    assert unpack(path, tmp_path / 'out', UnpackLimits()) == []
    assert unpack(link, tmp_path / 'out', UnpackLimits()) == ['Left out, because each is a link: passwd.']
    assert files_below(tmp_path / 'out') == {'a/' + NODE, 'a/builder.py', 'a/b/c.py'}
    unpack(zipped(tmp_path / 'c.zip', {'n.py': 'x'}), tmp_path / 'plain', UnpackLimits())
    assert [os.access(str(tmp_path / name), os.X_OK) for name in ('out/a/' + NODE, 'plain/n.py')
            ] == [True, False]


@pytest.mark.parametrize('name', ['../x.py', 'a/../../x.py', '/etc/x', 'C:\\x.py', '..\\x.py'])
def test_paths_that_lead_out_are_refused(tmp_path, name):
    path = zipped(tmp_path / 'in' / 'a.zip', {'good.py': 'x', name: 'x'})
    with pytest.raises(NotJudged, match='leads out of it'):
        unpack(path, tmp_path / 'in' / 'out', UnpackLimits())
    assert files_below(tmp_path) == {'in/a.zip'}


def test_the_archives_of_a_submission_have_one_budget(tmp_path, monkeypatch):
    """The submission has sixty zip bombs of 90 kB each, and a sparse file of zeros."""
    monkeypatch.setattr(archives, 'MAX_BYTES', 100000)
    bomb = zipped(tmp_path / 'bomb.zip', {'a.txt': '0' * 90000}).read_bytes()
    (tmp_path / 'in').mkdir()
    for number in range(60):
        (tmp_path / 'in' / 'a{}.zip'.format(number)).write_bytes(bomb)
    with open(str(tmp_path / 'in' / 'b.zip'), 'wb') as file:
        file.truncate(10 ** 12)
    _, unread = copy_submission({tmp_path / 'in': ''}, tmp_path / 'work', lambda: False)
    sizes = [file.stat().st_size for file in (tmp_path / 'work').rglob('*') if file.is_file()]
    assert sum(sizes) <= 100000
    assert 'More than 0.1 MB: not all of it was unpacked.' in unread


@pytest.mark.filterwarnings('ignore:Duplicate name')
def test_of_two_entries_of_one_place_the_last_one_counts_as_for_any_program(tmp_path):
    path = zipped(tmp_path / 'a.zip', [('n.py', 'old, and longer'), ('a/b.py', 'x'), ('n.py', 'new'),
                                       ('./a//b.py', 'y'), ('a\\b.py', 'z'), ('n.py/in.py', 'in')])
    assert unpack(path, tmp_path / 'out', UnpackLimits()) == [
        'Left out, because the zip file has it twice, and the last one counts: a/b.py, a/b.py, n.py.',
        'Left out, because no file here can have that name: n.py/in.py.']
    assert [(tmp_path / 'out' / name).read_text() for name in ('n.py', 'a/b.py')] == ['new', 'z']


def test_an_entry_that_cannot_be_written_costs_no_other(tmp_path):
    path = zipped(tmp_path / 'a.zip', {'n.py': 'x', 'x' * 300: 'x', 'a:b.txt': 'x', 'y/' * 9 + 'z' * 256: 'x'})
    data = zipped(tmp_path / 'b.zip', {'n.py': 'x', 'Q': 'x', './': ''}).read_bytes()     # Q becomes no name at all
    path.with_name('b.zip').write_bytes(data.replace(b'Q', b'\0'))
    for file, left in ((path, ['x' * 200, 'y/' * 9 + 'z' * 182]), (path.with_name('b.zip'), [''])):
        assert unpack(file, tmp_path / file.stem, UnpackLimits()) == [
            'Left out, because no file here can have that name: {}.'.format(', '.join(left))]
        assert 'n.py' in files_below(tmp_path / file.stem)
    assert (tmp_path / 'a' / 'a:b.txt').exists()


def test_an_entry_that_is_damaged_packed_otherwise_or_has_a_password_costs_no_other(tmp_path):
    """Some programs begin a zip file with the folder /."""
    data = zipped(tmp_path / 'a.zip', {'/': '', 'n.py': 'x', 'a.py': 'a photo'}).read_bytes()
    entry = data.rindex(b'PK\x01\x02')
    for number, (at, byte) in enumerate([(entry + 16, 0), (entry + 10, 97), (entry + 8, 1)]):
        file, out = tmp_path / 'b.zip', tmp_path / str(number)      # its CRC, method, flags
        file.write_bytes(data[:at] + bytes([byte]) + data[at + 1:])
        assert unpack(file, out, UnpackLimits()) == [
            'Left out, because the zip file is damaged there, or has a password: a.py.']
        assert files_below(out) == {'n.py'}
    assert unpack(zipped(tmp_path / 'c.zip', {'a/': ''}), tmp_path / 'c', UnpackLimits()) == []


def test_a_full_disk_is_no_matter_of_names(tmp_path, monkeypatch):
    path = zipped(tmp_path / 'a.zip', {'n.py': 'x'})

    def full(*_):
        raise OSError(28, 'No space left on device', '/tmp/of/the/marker')
    monkeypatch.setattr(archives.shutil, 'copyfileobj', full)
    with pytest.raises(NotJudged, match=r'cannot be unpacked: No space left on device\.$'):
        unpack(path, tmp_path / 'out', UnpackLimits())


@pytest.mark.parametrize('data, said', [
    (b'', 'it is empty'), (b'PK\x03\x04 cut off', 'its end is missing, as if the upload was cut off'),
    (b'Rar!\x1a', 'it is no zip file, and only zip files are unpacked'), (None, '')])
def test_a_file_that_is_no_zip_file_in_spite_of_its_name(tmp_path, data, said):
    """The last file is a zip file with false sizes."""
    if data is None:
        data = zipped(tmp_path / 'a.zip', {'a.txt': 'x' * 5000}).read_bytes().replace(
            (5000).to_bytes(4, 'little'), (50).to_bytes(4, 'little'))
    (tmp_path / 'a.zip').write_bytes(data)
    with pytest.raises(NotJudged, match='cannot be unpacked: {}'.format(said)):
        unpack(tmp_path / 'a.zip', tmp_path / 'out', UnpackLimits())


@pytest.mark.parametrize('name', ['a/' * 1500 + 'x.py', '"\n\u202e.py'])
def test_odd_paths_in_an_archive_end_nothing(tmp_path, name):
    files, said = laid_out(Submission('Ann', {zipped(tmp_path / 'a.zip', {name: 'x'}): 'a.zip'}), tmp_path)
    assert len(files) + len(said) == 1
    assert ('deeper than 50' in ' '.join(said)) is (name.count('/') > 50)


# -- submissions

@pytest.mark.parametrize('place', ['install/', 'logs/', 'venv/lab/', 'Build/', 'devel/share/'])
@pytest.mark.parametrize('is_zip', [False, True])
def test_a_folder_that_programs_make_is_read_if_the_node_is_nowhere_else(tmp_path, place, is_zip):
    files = {place + NODE: 'x', place + 'run.bag': 'x', '.git/n.py': 'x'}
    for with_own, expected in ((False, {place + NODE}), (True, {'n.py'})):
        path = zipped(tmp_path / 'a.zip', dict(files, **{'n.py': 'x'} if with_own else {}))
        if not is_zip:
            path = tmp_path / str(with_own)
            unpack(tmp_path / 'a.zip', path, UnpackLimits(), archives.IGNORED_PATHS)
        found, said = laid_out(Submission(str(with_own), {path: 'a.zip'}), tmp_path)
        assert (found, said) == ({'a.unpacked/' * is_zip + name for name in expected}, [])


def test_what_canvas_numbers_was_handed_in_again_and_the_highest_number_counts(tmp_path):
    for name, text in (('lee_1_30_lab7.zip', 'first'), ('lee_LATE_1_29_lab7-2.zip', 'third'),
                       ('lee_1_31_lab7-1.zip', 'second')):
        zipped(tmp_path / 'in' / name, {'lab7/move2goal.py': text})
    for name, text in (('kim_2_9_imu_sub.py', 'old'), ('kim_2_11_imu_sub-1.py', 'older'),
                       ('kim_2_12_imu_sub-10.py', 'new'), ('kim_2_13_imu_sub-9.py', 'x'),
                       ('Zoe_4_assignsubmission_file_', 'a file without a name of its own')):
        (tmp_path / 'in' / name).write_text(text)
    found = submissions_in(tmp_path / 'in', print)
    (zoe, _), (kim, kim_said), (lee, lee_said) = (laid_out(one, tmp_path) for one in found)
    assert (kim, lee) == ({'imu_sub.py'}, {'lab7.unpacked/lab7/move2goal.py'})
    assert zoe == {'Zoe_4_assignsubmission_file_'}
    assert [(tmp_path / 'work' / path).read_text() for path in (
        'kim/imu_sub.py', 'lee/lab7.unpacked/lab7/move2goal.py')] == ['new', 'third']
    assert lee_said == ['lab7.zip was handed in again: {} counts, not {}.'.format(*pair) for pair in (
        ('lee_1_31_lab7-1.zip', 'lee_1_30_lab7.zip'), ('lee_LATE_1_29_lab7-2.zip', 'lee_1_31_lab7-1.zip'))]
    assert len(kim_said) == 3 and 'imu_sub-10.py counts, not kim_2_13_imu_sub-9.py' in kim_said[-1]


def test_zip_files_that_differ_only_in_their_endings_stay_two(tmp_path):
    zipped(tmp_path / 'Bo' / 'a.zip', {'n.py': 'x'})
    zipped(tmp_path / 'Bo' / 'a.ZIP', {'n.py': 'y'})
    assert laid_out(Submission('Bo', {tmp_path / 'Bo': ''}), tmp_path) == (
        {'a.unpacked/n.py', 'a.unpacked_/n.py'}, [])


def test_folders_that_are_too_deep_are_left_out(tmp_path):
    deepest = tmp_path.joinpath(*'a' * DEEPEST)
    hand_in(deepest, {'n.py': 'x', 'b/n.py': 'x'})
    assert submitted_files(tmp_path) == ([deepest / 'n.py'], [deepest / 'b'])


def laid_out(submission, tmp_path):
    """Copy a submission. Returns (the files of the copy, all remarks)."""
    folder = tmp_path / 'work' / submission.student
    remarks, unread = copy_submission(submission.files, folder, lambda: any(folder.rglob('*.py')))
    return files_below(folder.resolve()), remarks + unread


def in_zip(path, folder):
    read_submission._unpack_class(str(path), str(folder / 'all'))
    return submissions_in(without_wrapping(folder / 'all'), print)


def test_a_platforms_whole_zip_file_with_or_without_a_folder_around_it(tmp_path, monkeypatch):
    inner = zipped(tmp_path / 'b.zip', {NODE: 'x'}).read_bytes()
    path = zipped(tmp_path / 'IMU lab.zip', {
        'IMU lab/Ann_1_assignsubmission_file_/' + NODE: 'x', 'IMU lab/No_3_assignsubmission_file_/': '',
        'IMU lab/Bo_2_assignsubmission_file_/b.zip': inner})
    found = in_zip(path, tmp_path)
    assert [submission.student for submission in found] == ['Ann', 'Bo', 'No']     # an empty folder
    assert laid_out(found[1], tmp_path) == ({'b.unpacked/' + NODE}, [])
    flat = zipped(tmp_path / 'flat.zip', {'Cy/' + NODE: 'x' * 150, 'Di/' + NODE: 'x'})
    assert [submission.student for submission in in_zip(flat, tmp_path / 'other')] == ['Cy', 'Di']
    monkeypatch.setattr(archives, 'MAX_BYTES', 100)     # a class has more room than a submission
    cy, di = in_zip(flat, tmp_path / 'third')
    assert laid_out(cy, tmp_path) == (set(), ['More than 0.0001 MB: not all of it was unpacked.'])
    assert laid_out(di, tmp_path) == ({NODE}, [])
    monkeypatch.setattr(read_submission, 'SUBMISSIONS_PER_CLASS_ZIP', 1)
    with pytest.raises(NotJudged, match='More than 0.0001 MB'):
        in_zip(flat, tmp_path / 'fourth')


PACKAGE = '<package><name>{}</name></package>'


@pytest.mark.parametrize('files, students', [
    # the packages of one student, a single package, or a workspace
    (['ann/lab1/package.xml', 'ann/lab2/' + NODE], 'ann'), (['ann/lab1/n.py', 'ann/final/n.py'], 'ann'),
    (['ann/lab1.zip', 'ann/lab2.zip'], 'ann'), (['ann/src/n.py', 'ann/msg/M.msg'], 'ann'),
    (['ann/tools/package.xml tools', 'ann/pictures/a.png'], 'ann'),
    (['ann/catkin_ws/src/lab2/n.py'], 'ann'),
    # students, each with a package or with the content of a package
    (['all/ann/lab2/package.xml lab2', 'all/bo/lab2/package.xml lab2'], 'ann bo'),
    (['all/lab2-B_1_assignsubmission_file_/n.py'], 'lab2-B'),
    (['all/ann/package.xml lab2', 'all/bo/package.xml bo_lab2', 'all/cy.zip'], 'ann bo cy'),
    (['all/ann/src/n.py', 'all/bo/n.py'], 'ann bo')])
def test_the_folder_of_one_student_is_no_folder_around_all(tmp_path, files, students):
    path = zipped(tmp_path / 'class.zip', {
        name.partition(' ')[0]: PACKAGE.format(name.partition(' ')[2] or 'x') for name in files})
    assert [one.student for one in in_zip(path, tmp_path)] == students.split()


def test_a_zip_file_in_a_zip_file_is_not_unpacked_and_that_is_told_unless_there_is_code(tmp_path):
    inner = zipped(tmp_path / 'inner.zip', {NODE: 'x'}).read_bytes()
    one = Submission('Ann', {zipped(tmp_path / 'one.zip', {'a/inner.zip': inner}): 'one.zip'})
    files, said = laid_out(one, tmp_path)
    assert files == {'one.unpacked/a/inner.zip'}
    assert said == ['inner.zip was not unpacked: only zip files are, and none in others.']
    two = hand_in(tmp_path / 'two', {'n.py': 'x'})
    (two / 'inner.zip').write_bytes(inner)
    assert laid_out(Submission('Bo', {two: ''}), tmp_path) == (
        {'n.py'}, ['Left out, because it is a zip file beside the node: inner.zip.'])


def test_what_is_left_out_or_cannot_be_unpacked_is_told(tmp_path):
    folder = hand_in(tmp_path / 'a', {'work.zip': 'x', 'work.rar': 'x'})
    (folder / 'link').symlink_to('/etc/passwd')
    files, remarks = laid_out(Submission('Ann', {folder: ''}), tmp_path)
    assert files == {'work.rar'}
    assert remarks[0] == 'Left out, because each is a link, a device, too deep, or may not be read: link.'
    assert 'cannot be unpacked' in remarks[1] and 'work.rar was not unpacked' in remarks[2]


def test_links_and_odd_files_among_the_submissions_are_left_out(tmp_path):
    """A link may lead to another student's work, to the whole disk, or to an endless device."""
    (tmp_path / 'in' / 'ann').mkdir(parents=True)
    for name, target in (('bo', tmp_path / 'in' / 'ann'), ('cy', '/'), ('di.zip', '/dev/zero')):
        (tmp_path / 'in' / name).symlink_to(target)
    os.mkfifo(str(tmp_path / 'in' / 'ed.zip'))
    hand_in(tmp_path / 'in', {'fay.csv': 'x', '__MACOSX/a': 'x', '.git/a': 'x'})
    told = []
    found = submissions_in(tmp_path / 'in', told.append)
    assert [submission.student for submission in found] == ['ann']
    assert told == ['left out, because it is {}: {}'.format(why, tmp_path / 'in' / name) for name, why in (
        ('bo', 'a link'), ('cy', 'a link'), ('di.zip', 'a link'), ('ed.zip', 'neither a folder nor a file'),
        ('fay.csv', 'neither a folder nor a zip file'))]


def test_no_link_within_a_submission_is_followed(tmp_path):
    hand_in(tmp_path, dict.fromkeys(('out.py', 'in/lab1/M.msg', 'in/lab1/deep/n.py', 'in/.git'), 'x'))
    os.link(str(tmp_path / 'out.py'), str(tmp_path / 'in' / 'lab1' / 'hard.py'))
    for link, target in (('msg', 'lab1'), ('n.py', 'lab1/deep/n.py'), ('loop', 'loop'), ('out', '../out.py'),
                         ('up', '..'), ('hard', 'lab1/hard.py'), ('git', '.git'), ('all', '/')):
        (tmp_path / 'in' / link).symlink_to(target)
    files, said = laid_out(Submission('Ann', {tmp_path / 'in': ''}), tmp_path)
    assert files == {'lab1/M.msg', 'lab1/deep/n.py'}
    assert len(said) == 1 and said[0].endswith('may not be read: all, git, hard and 6 more.')


@pytest.mark.parametrize('is_zip', [False, True])
def test_the_packages_of_a_python_environment_leave_room_for_the_node(tmp_path, monkeypatch, is_zip):
    monkeypatch.setattr(archives, 'MAX_FILES', 20)
    files = {'my_env/lib/site-packages/p{}/x.py'.format(number): '' for number in range(30)}
    files.update({'a/deep/pictures/{}.png'.format(number): '' for number in range(30)}, **{NODE: 'x'})
    path = zipped(tmp_path / 'work.zip', files)
    if not is_zip:
        unpack(path, tmp_path / 'ann', UnpackLimits(9))
        path = tmp_path / 'ann'
    copied, said = laid_out(Submission('Ann', {path: path.name}), tmp_path)
    assert ('work.unpacked/' * is_zip + NODE) in copied and len(copied) == 20
    assert said == ['More than 20 files: not all of it was unpacked.']


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can become another user')
def test_what_may_not_be_read_is_left_out_and_said(request):
    folder = pathlib.Path(tempfile.mkdtemp())
    request.addfinalizer(lambda: shutil.rmtree(str(folder)))
    skip_if_closed(folder)
    hand_in(folder, {'shut/n.py': 'x', 'names/n.py': 'x', 'open/n.py': 'x', 'm.py': 'x'})
    for name, mode in (('.', 0o755), ('shut', 0), ('names', 0o444), ('m.py', 0)):
        (folder / name).chmod(mode)
    os.setresuid(65534, 65534, 0)
    try:
        files, refused = submitted_files(folder)
    finally:
        os.setresuid(0, 0, 0)
    assert [str(path.relative_to(folder)) for path in files + refused] == ['open/n.py', 'names/n.py', 'shut', 'm.py']
    assert len(files) == 1


def test_a_digest_depends_on_names_and_contents(tmp_path):
    found = {digest(hand_in(tmp_path / str(number), {name: text})) for number, (name, text) in enumerate(
        [('n.py', 'x'), ('n.py', 'y'), ('m.py', 'x'), ('n.py', 'x')])}
    assert len(found) == 3
