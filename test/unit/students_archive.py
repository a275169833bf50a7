"""The students' archive, as the page for instructors makes it of the last commit."""
import re
import shutil
import subprocess

from pages import ROOT

PAGE = ROOT / 'doc' / 'instructor' / 'teaching.md'
README = ROOT / 'doc' / 'instructor' / 'archive' / 'README.md'
LIST = ROOT / 'doc' / 'instructor' / 'students.txt'
EXCLUDE = ':(exclude)'
#: '' or the reason why it cannot be made here.
MISSING = '' if shutil.which('git') and (ROOT / '.git').exists() else 'this copy is not in git'


def unpack(folder):
    """Type the commands of the page, and of the archive's README: the folder `tb3_labs` in `folder`."""
    made, = re.findall(r'^git archive .*\n.*\n.*', PAGE.read_text(encoding='utf-8'), re.MULTILINE)
    typed, = re.findall(r'`(tar .*?)`', README.read_text(encoding='utf-8'))
    for commands in (made, typed):
        subprocess.run(['bash', '-ec', commands.replace('students.tar', str(folder / 'students.tar')).replace(
            '~', str(folder))], cwd=str(ROOT), check=True)
    (folder / 'students.tar.gz').unlink()
