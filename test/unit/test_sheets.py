"""The lab sheets hold every number that is graded. Their figures and teaching.md fit the code."""
import re
import xml.etree.ElementTree as ET

import pytest
from pages import ROOT

import make_graded
from sheets_steps import steps_of
from tb3_labs.handout import STATES, TURN_DEG
from tb3_labs.marking.marks import LABS


def read(sheet):
    return (ROOT / 'doc' / sheet).read_text(encoding='utf-8')


SHEETS = sorted({criterion.sheet_step.sheet for lab in LABS.values() for criterion in lab.criteria})


def test_the_command_writes_the_tables(tmp_path, monkeypatch):
    (tmp_path / 'doc').mkdir()
    for sheet in SHEETS:
        (tmp_path / 'doc' / sheet).write_text(make_graded.MADE_PART.sub(r'\1', read(sheet)), encoding='utf-8')
    monkeypatch.setattr(make_graded, 'ROOT', tmp_path)
    make_graded.main()
    assert [(tmp_path / 'doc' / sheet).read_text(encoding='utf-8') for sheet in SHEETS] == list(map(read, SHEETS))


def test_a_sheet_has_the_points_of_an_extra(monkeypatch, tmp_path):
    points = make_graded.POINTS.read_text(encoding='utf-8')
    monkeypatch.setattr(make_graded, 'POINTS', tmp_path / 'points.yaml')
    make_graded.POINTS.write_text(points.replace('within_1_deg: 0', 'within_1_deg: 1.5'), encoding='utf-8')
    sheet = make_graded.with_tables(read('imu_lab.md'))
    assert sheet.replace('`extra_within_1_deg` (points: 1.5):', '`extra_within_1_deg`:') == read('imu_lab.md') != sheet
    for name in 'imu_lab.md', 'transformation_lab.md':
        assert 'Extras earn nothing, unless their line says so.' in read(name)


@pytest.mark.parametrize('lab', sorted(LABS))
def test_every_part_of_a_check_is_named(lab):
    """In the sheet, and by the check's launch file. test_marking.py has those in marking.md."""
    parts, sheet = LABS[lab].parts, read(LABS[lab].criteria[0].sheet_step.sheet)
    listed = sheet.split('check_{}.test'.format(lab))[1].split('The check has the part')[1]
    of_check, of_extras, *_ = re.split(r'\.\s', listed)
    assert re.findall(r'`"?(?:parts:=)?([a-z ]+)"?`', of_check + of_extras) == parts
    check = (ROOT / 'launch' / 'checks' / 'check_{}.test'.format(lab)).read_text(encoding='utf-8')
    assert 'only these parts: {}"'.format(', '.join(parts)) in check


#: Names, commands and sentences of the handouts that a reader will look for in the sheets.
HANDOUTS = '''Lab6: IMU|Lab 2|Lab7: Transformation|Master|ICM-20648|OpenCR 1.0|middle of the robot|magnetic|170
    Test the IMU|enable_statistics|echoed|makes computing easier|squaternion|raise your hand|controller.py|lab1|`= 0`
    Update this line|Resources/Lab Template|Gradescope|Lab 2 channel|GitHub|roscore must have ended|jupyter-lab
    order: server|drives as soon as it runs|ctrl_relinq|lab4_gamepad|Lab 6|ece387_ws|nav2_msgs|entry_points|ccbuild
    ros2 node list|`robotX`|ls -la|look for the line|ROS_DOMAIN_ID|interactive|View > Command Palette|Remote-SSH
    password|couple of minutes|/home/pi|case $- in|ssh -t pi@robot3 'roslaunch|alias bringup|set-up is right|AMCL'''


def test_what_a_reader_of_a_handout_looks_for_is_on_a_page():
    pages = ' '.join(' '.join(read(name).split()) for name in (
        'imu_lab.md', 'transformation_lab.md', 'handout.md'))
    assert [words for line in HANDOUTS.splitlines() for words in line.strip().split('|') if words not in pages] == []


def test_a_master_for_a_robot_is_started_where_its_address_is_set():
    """Without ROS_IP a terminal of setup.sh listens only on its own computer, so a robot's nodes do not reach it."""
    commands = [step.commands for step in steps_of(read('handout.md')) if 'roscore' in step.commands]
    assert commands and [line.split('=')[0].split('/')[-1] for line in commands[0]] == [
        'export ROS_IP', 'setup.sh', 'roscore']


def test_the_open_todos_that_the_sheets_show_are_those_of_the_skeletons():
    skeletons = ''.join(path.read_text(encoding='utf-8') for path in sorted(
        (ROOT / 'doc' / 'skeletons').glob('*/src/*')))
    shown = [line.strip() for sheet in ('imu_lab.md', 'transformation_lab.md')
             for line in read(sheet).splitlines() if re.match(r' *TODO \d+ is open', line)]
    assert len(shown) > 2 and [line for line in shown if line not in skeletons] == []


def test_the_prompt_that_the_sheet_shows_is_that_of_the_node():
    prompt = re.search(r'```text\n *(Input .*)\n', read('imu_lab.md')).group(1)
    assert 'input("{}")'.format(prompt) in (ROOT / 'scripts' / 'plain_turtlebot_controller.py').read_text()


def asked_in_steps(sheet):
    """Returns the places of a sheet, such as '1.2', whose steps have a question. The section Questions, code, and help
    after an *If ...* are left out."""
    text = re.sub(r' *```.*?\n *```', '', re.sub(
        r'\n#+ Questions\n.*?(?=\n##? |\Z)', '', sheet, flags=re.DOTALL), flags=re.DOTALL)
    places, section, step = [], '', ''
    for paragraph in re.split(r'\n\s*\n|\n(?=#|\d+\. |\* )', text):
        heading = re.match(r'#+ (\d+\.|\w+)', paragraph)
        number = re.match(r'\s*(?:\*\*)?(\d+)\. ', paragraph)
        if heading:
            section, step = heading.group(1), ''
            section += '' if section.endswith('.') else ', '
        step = number.group(1) if number else step
        if '?' in re.sub(r'\*If [^?]*\?', '', paragraph):
            places.append((section + step).rstrip('.'))
    return list(dict.fromkeys(places))


def test_every_question_has_an_answer():
    answers = read('instructor/teaching.md').split('## Answers')[1]
    for lab, sheet in (('IMU', 'imu_lab.md'), ('Transformation', 'transformation_lab.md')):
        questions = read(sheet).split('## Questions')[1].split('\n## ')[0]
        given = answers.split(lab + ' lab:')[1].split(' lab:')[0]
        assert re.findall(r'^\d+\.', questions, re.M) == re.findall(r'^\d+\.', given, re.M)
        steps = re.findall(r'^\* (?:Step (\d[\d.]*)|(\w+), step (\d)): ', given, re.M)
        assert asked_in_steps(read(sheet)) == [place or f'{section}, {step}' for place, section, step in steps]


def words_of(figure):
    """The texts of a figure of the sheets, each without its blanks, such as 'p_A=(1,3)' without its underscore."""
    root = ET.parse(str(ROOT / 'doc' / 'figures' / (figure + '.svg'))).getroot()
    return [''.join(''.join(text.itertext()).split()) for text in root.iter('{http://www.w3.org/2000/svg}text')]


@pytest.mark.parametrize('figure, shown', [
    ('error', [f'{TURN_DEG:+g}', f'{TURN_DEG - 360.0:g}', '350', f'goal_yaw{(350.0 + TURN_DEG) % 360.0:g}']),
    ('states', STATES[:3])])
def test_a_figure_shows_the_numbers_and_names_of_the_handout(figure, shown):
    assert set(shown) <= set(words_of(figure))


def test_the_figures_show_the_example_of_the_sheet():
    """The sheet's places and headings have two decimals, the figures' headings one."""
    sheet = ' '.join(read('transformation_lab.md').split())
    place = r'\((\d), (\d)\) and ([\d.]+) degrees'
    (x, y, theta), (x_A, y_A, theta_A) = (
        re.search(f'odometry {word} {place}', sheet).groups() for word in ('showed', 'shows'))
    x_B, y_B, theta_B = re.search(r'at \((\d), (\d)\) in B, and faces (\d+) degrees', sheet).groups()
    assert {f't=({x},{y})', f'pA=({x_A},{y_A})', f'pB=({x_B},{y_B})'} <= set(words_of('point'))
    assert {f'\u03b8={float(theta):.1f}', f'\u03b8A={float(theta_A):.1f}', f'\u03b8B={theta_B}'} <= set(
        words_of('heading'))
