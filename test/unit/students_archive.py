"""The students' archive, as the page for instructors makes it of the last commit."""
import pathlib
import re
import shutil
import subprocess
import zipfile

from pages import ROOT

PAGE = ROOT / 'doc' / 'instructor' / 'teaching.md'
LIST = ROOT / 'doc' / 'instructor' / 'students.txt'
EXCLUDE = ':(exclude)'
#: '' or the reason why it cannot be made here.
MISSING = '' if shutil.which('git') and (ROOT / '.git').exists() else 'this copy is not in git'


def unpack(folder):
    """Type the page's commands, and unpack the archive: the folder `tb3_labs` in `folder`."""
    commands, = re.findall(r'^git archive .*\n.*', PAGE.read_text(encoding='utf-8'), re.MULTILINE)
    place = folder / 'students.zip'
    subprocess.run(['bash', '-ec', commands.replace('students.zip', str(place))], cwd=str(ROOT), check=True)
    with zipfile.ZipFile(str(place)) as archive:
        for item in archive.infolist():    # Python's extractall makes no file executable
            path = pathlib.Path(archive.extract(item, str(folder)))
            path.chmod(item.external_attr >> 16 & 0o777 or 0o755)
    place.unlink()
