"""Runs the steps of doc/instructor/classroom.yml one by one in a folder, as GitHub does on its machine.

Usage: workflow.py REPOSITORY FOLDER [install]

REPOSITORY is a course's repository with .github/tb3_labs.tar.gz in it; FOLDER is a new one, for the copy
`work/submission`, the pages `temp/marks`, and what the steps write. Steps with `uses:` are printed as skipped. Without
`install` the word sudo does nothing: this machine keeps its settings of apt, so it must have the system's packages
already. The exit status is that of the last step.
"""
import base64
import pathlib
import shutil
import subprocess
import sys

import yaml

FLOW = pathlib.Path(__file__).resolve().parents[2] / 'doc' / 'instructor' / 'classroom.yml'


def main(repository, folder, install=None):
    """Run the steps until one fails; print the result that Classroom's reporter reads."""
    folder = pathlib.Path(folder).resolve()
    flow = yaml.safe_load(FLOW.read_text(encoding='utf-8'))
    job, = flow['jobs'].values()
    work, temp, output = folder / 'work', folder / 'temp', folder / 'output'
    shutil.copytree(repository, str(work / 'submission'), symlinks=True)    # actions/checkout
    for made in (temp / 'bin', temp / 'home'):
        made.mkdir(parents=True)
    if install != 'install':
        (temp / 'bin' / 'sudo').write_text('#!/bin/sh\necho "skipped: sudo $*" >&2\n')
        (temp / 'bin' / 'sudo').chmod(0o755)
    output.touch()
    environment = dict(
        {name: str(value) for name, value in flow['env'].items()}, HOME=str(temp / 'home'), CI='true',
        PATH=f'{temp}/bin:/usr/bin:/bin', RUNNER_TEMP=str(temp), GITHUB_WORKSPACE=str(work), GITHUB_OUTPUT=str(output))
    status = 0
    for number, step in enumerate(job['steps']):
        print('==', step.get('name') or step['uses'], '' if 'run' in step else '(skipped)', flush=True)
        if 'run' in step and status == 0:
            script = temp / f'{number}.sh'
            script.write_text(step['run'], encoding='utf-8')
            status = subprocess.call(['bash', '-e', str(script)], cwd=str(work), env=environment)
    for line in output.read_text().splitlines():
        name, _, value = line.partition('=')
        print(f'{name}={base64.b64decode(value).decode()}')
    return status


if __name__ == '__main__':
    sys.exit(__doc__ if len(sys.argv) not in (3, 4) else main(*sys.argv[1:]))
