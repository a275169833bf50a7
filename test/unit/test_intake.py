"""Names that learning platforms give to submissions, and the unpacking of archives."""
import os
import pathlib
import shutil
import tempfile
import zipfile

import pytest

from sandboxes import hand_in, skip_if_closed
from tb3_labs.marking.intake import archives
from tb3_labs.marking.intake.archives import NotJudged, SubmissionCopy, copy_submission, digest_of, submitted_files
from tb3_labs.marking.intake.submissions import (
    PlatformName, Submission, grouped_by_student, platform_name_of, read_submission, submissions_in, valid_file_name)
from tb3_labs.marking.student_nodes import LAB_NODES

NODE = 'lab2/scripts/turtlebot_controller.py'


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
    assert platform_name_of(name, is_folder) == PlatformName(*said)


def test_files_of_one_student_belong_together_and_namesakes_do_not():
    names = ['lee_1_11_a.py', 'lee_1_12_b.msg', 'lee_2_13_a.py', 'kim_3_14_a.zip', 'kim.zip', 'kim']
    assert grouped_by_student({name: platform_name_of(name, '.' not in name) for name in names}) == {
        'lee (1)': ['lee_1_11_a.py', 'lee_1_12_b.msg'], 'lee (2)': ['lee_2_13_a.py'],
        'kim (3)': ['kim_3_14_a.zip'], 'kim (kim.zip)': ['kim.zip'], 'kim (kim)': ['kim']}


#: Names that break rules of file systems or programs.
NASTY = ['"><script>', "O'Hara; rm -rf ~", 'two\nlines', '\x1b[2Jann', '.._', '...', 'x' * 255,
         '\u202egnp.exe', '\u05d0\u05d1\u05d2', os.fsdecode(b'M\xfcller'), '=cmd|calc!A1',
         'overview', 'ann.marks', ' ', 'a\\b', os.fsdecode(b'\xff' * 255)]


def test_every_name_becomes_a_different_one_that_files_and_lines_can_have():
    for name in NASTY:
        made = valid_file_name(name)
        assert made.isprintable() and '/' not in made and len(made.encode()) < 200
        assert valid_file_name(made) == made and made not in ('', '.', '..', 'overview')
    for name in ('Ann-Li de Groot', 'M\xfcller', 'kim (2)', '\u05d0'):
        assert valid_file_name(name) == name
    assert valid_file_name(os.fsdecode(b'M\x80\xff')) == 'M\\x80\\xff'
    names = NASTY + ['M\\xfcller', 'M\\xfcller_', 'x' * 254, '..', 'Ann', 'Ann ']
    found = grouped_by_student({name: platform_name_of(name, True) for name in names})
    assert sorted(name for name, in found.values()) == sorted(names)


def zipped(path, files, **changes):
    """Write a zip file. `files` is a dict {name: text}, or a list of (name, text). Returns the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(str(path), 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items() if isinstance(files, dict) else files:
            info = zipfile.ZipInfo(name, changes.get('date', (2026, 11, 20, 12, 0, 0)))
            info.external_attr = changes.get('mode', 0o644) << 16
            archive.writestr(info, text, zipfile.ZIP_DEFLATED)
    return path


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file()}


def unpacked(path, folder):
    """Unpack a zip file. Returns the remarks."""
    copy = SubmissionCopy(folder)
    copy.unpack(path, pathlib.PurePath())
    return copy.remarks()


def test_what_is_nobodys_work_is_not_unpacked(tmp_path):
    """A link is not unpacked. Windows writes backslashes into a path. Some programs begin a zip file with the
    folder /."""
    path = zipped(tmp_path / 'a.zip', {
        '/': '', 'a/' + NODE: 'x', '__MACOSX/a/._x.py': 'x', 'a/.DS_Store': 'x', 'a/run.bag': 'x',
        'a/.git/config': 'x', 'a/build/x.py': 'x', 'a/builder.py': 'x', 'a\\b\\c.py': 'x'},
        mode=0o755)
    link = zipped(tmp_path / 'b.zip', {'passwd': '/etc/passwd'}, mode=0o120777)
    assert unpacked(path, tmp_path / 'out') == []
    assert unpacked(link, tmp_path / 'links') == ['Left out, because each is a link: passwd.']
    assert files_below(tmp_path / 'out') == {'a/' + NODE, 'a/builder.py', 'a/b/c.py'}
    unpacked(zipped(tmp_path / 'c.zip', {'n.py': 'x'}), tmp_path / 'plain')
    assert [os.access(str(tmp_path / name), os.X_OK) for name in ('out/a/' + NODE, 'plain/n.py')
            ] == [True, False]
    assert files_below(tmp_path / 'links') == set()


@pytest.mark.parametrize('name', ['../x.py', 'a/../../x.py', '/etc/x', 'C:\\x.py', '..\\x.py'])
def test_paths_that_lead_out_are_refused(tmp_path, name):
    path = zipped(tmp_path / 'in' / 'a.zip', {name: 'x'})
    with pytest.raises(NotJudged, match='leads out of it'):
        unpacked(path, tmp_path / 'in' / 'out')
    assert files_below(tmp_path) == {'in/a.zip'}


def test_the_archives_of_a_submission_have_one_budget(tmp_path, monkeypatch):
    """The submission has sixty zip bombs of 90 kB each. A large file is left out, and uses nothing of the budget."""
    monkeypatch.setattr(archives, 'MAX_SUBMISSION_BYTES', 100000)
    monkeypatch.setattr(archives, 'MAX_COPIED_BYTES', 95000)
    bomb = zipped(tmp_path / 'bomb.zip', {'a.txt': '0' * 90000, 'video': '0' * 96000}).read_bytes()
    (tmp_path / 'in').mkdir()
    (tmp_path / 'in' / 'a.zip').write_bytes(bomb)
    with open(str(tmp_path / 'in' / 'video'), 'wb') as file:
        file.truncate(10 ** 12)
    assert copy_submission({tmp_path / 'in': ''}, tmp_path / 'one') == [
        'Left out, because each is larger than 0.095 MB: a.unpacked/video, video.']
    for number in range(60):
        (tmp_path / 'in' / 'a{}.zip'.format(number)).write_bytes(bomb)
    with pytest.raises(NotJudged, match='more than 5000 files, or more than 0.1 MB'):
        copy_submission({tmp_path / 'in': ''}, tmp_path / 'work')
    sizes = [file.stat().st_size for file in (tmp_path / 'work').rglob('*') if file.is_file()]
    assert sum(sizes) <= 100000


@pytest.mark.filterwarnings('ignore:Duplicate name')
def test_of_two_entries_of_one_place_the_last_one_counts_as_for_any_program(tmp_path):
    path = zipped(tmp_path / 'a.zip', [('n.py', 'old, and longer'), ('a/b.py', 'x'), ('n.py', 'new'),
                                       ('./a//b.py', 'y'), ('a\\b.py', 'z')])
    assert unpacked(path, tmp_path / 'out') == []
    assert [(tmp_path / 'out' / name).read_text() for name in ('n.py', 'a/b.py')] == ['new', 'z']


def damaged(path, at, byte):
    """Write a zip file, in which a byte of the last entry is changed. Returns the path."""
    data = zipped(path, {'n.py': 'x', 'a.py': 'a photo'}).read_bytes()
    entry = data.rindex(b'PK\x01\x02')
    path.write_bytes(data[:entry + at] + bytes([byte]) + data[entry + at + 1:])
    return path


FALSE_SIZES = ((5000).to_bytes(4, 'little'), (50).to_bytes(4, 'little'))


@pytest.mark.parametrize('made', [
    lambda path: damaged(path, 16, 0), lambda path: damaged(path, 10, 97),      # its CRC, its method
    lambda path: damaged(path, 8, 1),       # its password
    lambda path: path.write_bytes(b''), lambda path: path.write_bytes(b'PK\x03\x04 cut off'),
    lambda path: path.write_bytes(zipped(path, {'a.txt': 'x' * 5000}).read_bytes().replace(*FALSE_SIZES)),
    lambda path: zipped(path, {'x' * 300: 'x'}), lambda path: zipped(path, {'n.py': 'x', 'n.py/in.py': 'in'})])
def test_a_zip_file_that_cannot_be_unpacked_is_not_judged(tmp_path, made):
    made(tmp_path / 'a.zip')
    with pytest.raises(NotJudged, match=r'^The zip file a.zip cannot be unpacked: [^/]+\.$'):
        unpacked(tmp_path / 'a.zip', tmp_path / 'out')


def test_a_full_disk_is_told_without_the_markers_paths(tmp_path, monkeypatch):
    path = zipped(tmp_path / 'a.zip', {'n.py': 'x'})

    def full(*_):
        raise OSError(28, 'No space left on device', '/tmp/of/the/marker')
    monkeypatch.setattr(archives.shutil, 'copyfileobj', full)
    with pytest.raises(NotJudged, match=r'cannot be unpacked: No space left on device\.$'):
        unpacked(path, tmp_path / 'out')


def test_odd_paths_in_an_archive_end_nothing(tmp_path):
    files, said = laid_out(Submission('Ann', {zipped(tmp_path / 'a.zip', {'"\n\u202e.py': 'x'}): 'a.zip'}), tmp_path)
    assert len(files) == 1 and said == []
    with pytest.raises(NotJudged, match='deeper than 50'):
        unpacked(zipped(tmp_path / 'b.zip', {'a/' * 1500 + 'x.py': 'x'}), tmp_path / 'b')


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
    assert lee_said == ['lab7.zip was handed in again: {} counts.'.format(name) for name in (
        'lee_1_31_lab7-1.zip', 'lee_LATE_1_29_lab7-2.zip')]
    assert len(kim_said) == 3 and 'imu_sub-10.py counts' in kim_said[-1]


def laid_out(submission, tmp_path):
    """Copy a submission. Returns (the files of the copy, all remarks)."""
    folder = tmp_path / 'work' / submission.student
    remarks = copy_submission(submission.files, folder)
    return files_below(folder.resolve()), remarks


def test_a_zip_file_in_a_zip_file_is_not_unpacked(tmp_path):
    inner = zipped(tmp_path / 'inner.zip', {NODE: 'x'}).read_bytes()
    one = Submission('Ann', {zipped(tmp_path / 'one.zip', {'a/inner.zip': inner}): 'one.zip'})
    assert laid_out(one, tmp_path) == ({'one.unpacked/a/inner.zip'}, [])
    two = hand_in(tmp_path / 'two', {'n.py': 'x', 'work.rar': 'x'})
    (two / 'inner.zip').write_bytes(inner)
    assert laid_out(Submission('Bo', {two: ''}), tmp_path) == (
        {'n.py', 'work.rar', 'inner.unpacked/' + NODE}, [])


def test_links_and_odd_files_among_the_submissions_are_left_out(tmp_path):
    """A link may lead to another student's work, to the whole disk, or to an endless device."""
    (tmp_path / 'in' / 'ann').mkdir(parents=True)
    for name, target in (('bo', tmp_path / 'in' / 'ann'), ('cy', '/'), ('di.zip', '/dev/zero')):
        (tmp_path / 'in' / name).symlink_to(target)
    os.mkfifo(str(tmp_path / 'in' / 'ed.zip'))
    hand_in(tmp_path / 'in', {'__MACOSX/a': 'x', '.git/a': 'x'})
    told = []
    found = submissions_in(tmp_path / 'in', told.append)
    assert [submission.student for submission in found] == ['ann']
    assert told == ['left out, because it is a link or a device: {}'.format(tmp_path / 'in' / name)
                    for name in ('bo', 'cy', 'di.zip', 'ed.zip')]


def test_every_file_among_the_submissions_is_somebodys_and_a_wrong_archive_is_not_judged(tmp_path):
    hand_in(tmp_path / 'in', dict.fromkeys(('Tara.tar.gz', 'Uwe M.rar', 'Wim', 'J.R. Xu.7z', 'Yan/n.rar'), 'x'))
    found = submissions_in(tmp_path / 'in', print)
    assert [submission.student for submission in found] == ['J.R. Xu', 'Tara', 'Uwe M', 'Wim', 'Yan']
    for submission, file in zip(found[1:3], ('Tara.tar.gz', 'Uwe M.rar')):
        with pytest.raises(NotJudged, match=f'Handed in.*: {file}. Only zip files are unpacked'):
            read_submission(submission, tmp_path / 'copy' / file, LAB_NODES['turn'])


def test_no_link_within_a_submission_is_followed(tmp_path):
    hand_in(tmp_path, dict.fromkeys(('out.py', 'in/lab1/M.msg', 'in/lab1/deep/n.py', 'in/.git'), 'x'))
    os.link(str(tmp_path / 'out.py'), str(tmp_path / 'in' / 'lab1' / 'hard.py'))
    for link, target in (('msg', 'lab1'), ('n.py', 'lab1/deep/n.py'), ('loop', 'loop'), ('out', '../out.py'),
                         ('up', '..'), ('hard', 'lab1/hard.py'), ('git', '.git'), ('all', '/')):
        (tmp_path / 'in' / link).symlink_to(target)
    files, said = laid_out(Submission('Ann', {tmp_path / 'in': ''}), tmp_path)
    assert files == {'lab1/M.msg', 'lab1/deep/n.py'}
    assert len(said) == 1 and said[0].endswith('a link or a device: all, git, hard and 6 more.')


def test_a_python_environment_uses_nothing_of_the_budget(tmp_path, monkeypatch):
    monkeypatch.setattr(archives, 'MAX_FILES', 20)
    files = {'my_env/lib/site-packages/p{}/x.py'.format(number): '' for number in range(30)}
    files.update({'venv/lib/{}.py'.format(number): '' for number in range(30)}, **{NODE: 'x'})
    for path in (zipped(tmp_path / 'work.zip', files), hand_in(tmp_path / 'ann', files)):
        copied, _ = laid_out(Submission(path.stem, {path: path.name}), tmp_path)
        assert len(copied) == 1


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can become another user')
def test_a_folder_that_cannot_be_read_is_an_error(request):
    folder = pathlib.Path(tempfile.mkdtemp())
    request.addfinalizer(lambda: shutil.rmtree(str(folder)))
    skip_if_closed(folder)
    hand_in(folder, {'shut/n.py': 'x', 'm.py': 'x'})
    for name, mode in (('.', 0o755), ('shut', 0)):
        (folder / name).chmod(mode)
    os.setresuid(65534, 65534, 0)
    try:
        with pytest.raises(PermissionError):
            submitted_files(folder)
    finally:
        os.setresuid(0, 0, 0)


def test_a_digest_depends_on_names_and_contents(tmp_path):
    found = {digest_of(hand_in(tmp_path / str(number), {name: text})) for number, (name, text) in enumerate(
        [('n.py', 'x'), ('n.py', 'y'), ('m.py', 'x'), ('n.py', 'x')])}
    assert len(found) == 3
