"""Makes the students' archive of the last commit by the commands of the page for instructors."""
import re
import shutil
import subprocess

from pages import ROOT

PAGE = ROOT / 'doc' / 'instructor' / 'teaching.md'
README = ROOT / 'doc' / 'instructor' / 'archive' / 'README.md'
LIST = ROOT / 'doc' / 'instructor' / 'students.txt'
EXCLUDE = ':(exclude)'
#: The reason why the archive cannot be made here, or ''.
MISSING = '' if shutil.which('git') and (ROOT / '.git').exists() else 'this copy is not in git'


def unpack(folder):
    """Run the commands of the page and of the archive's README. They make the folder `tb3_labs` in `folder`."""
    made, = re.findall(r'^git archive .*\n.*\n.*', PAGE.read_text(encoding='utf-8'), re.MULTILINE)
    typed, = re.findall(r'`(tar .*?)`', README.read_text(encoding='utf-8'))
    for commands in (made, typed):
        subprocess.run(['bash', '-ec', commands.replace('students.tar', str(folder / 'students.tar')).replace(
            '~', str(folder))], cwd=str(ROOT), check=True)
    (folder / 'students.tar.gz').unlink()
