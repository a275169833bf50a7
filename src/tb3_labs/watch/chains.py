"""The chain of each lab, as data: its links, and the variables by which its node is known."""
from typing import Any, Dict, List, Sequence, Tuple

from tb3_labs.watch import drive_links, drive_pose, input_links, turn_links
from tb3_labs.watch.broken_link import BrokenLink, Link, NodeRun, first_broken, sentence
from tb3_labs.watch.variables import bare, nodes_of

EXERCISE, TURN_LAB = '2. Exercise: the heading', '3. Lab: turn 90 and 180 degrees'
POSE, STATES, RESET, THUMB = (
    '1. The local pose', '2. The four states', '3. The reset', '4. By thumb')
DRIVE_SHEET = 'transformation_lab.md'
#: The parts of the labs in which a link shows.
TURNS, MOUSE, DRIVES, CONTROL = ('turns', 'both'), ('mouse', 'both'), (
    'drive', 'reset'), ('drive', 'reset', 'control')
STICKS = 'sticks', 'buttons', 'no service'
#: lab -> its links, in their order
CHAINS: Dict[str, Sequence[Link]] = {
    'imu': (
        Link('Turn the robot once around by hand: over which range does the printed number run, '
             'and which way?', input_links.wrong_heading, EXERCISE, 3),),
    'turn': (
        Link('Look at curr_yaw while you turn the robot once around by hand.',
             turn_links.wrong_heading, TURN_LAB, 4, parts=TURNS),
        Link('Look at goal_yaw: which one does each letter give, at which curr_yaw?',
             turn_links.wrong_goal, TURN_LAB, 5, parts=TURNS),
        Link('rostopic hz /cmd_vel: how often does a command come, and who sends it?',
             turn_links.too_seldom, TURN_LAB, 5, parts=TURNS),
        Link('Look at turning: when does it become True, and when False?', turn_links.not_turning,
             TURN_LAB, 5, parts=TURNS),
        Link('Which command belongs to an error of 90, of -90, of 270?', turn_links.wrong_command,
             TURN_LAB, 5, parts=TURNS),
        *(Link('At which error does a turn end, and by which command?', check, TURN_LAB, 5,
               parts=TURNS) for check in (turn_links.wrong_stop, turn_links.not_over)),
        *(Link('Which command belongs to the mouse at the upper edge, at the left one, in the '
               'middle, inactive?', check, TURN_LAB, 2, parts=MOUSE)
          for check in input_links.MOUSE_LINKS),
        Link('How large is the command for an error of 90?', turn_links.slow_law, TURN_LAB, 5,
             parts=TURNS)),
    'move2goal': (
        Link('Look at has_control: when does it become True, and when False?',
             drive_links.wrong_control, STATES, 2, DRIVE_SHEET, CONTROL),
        Link('Look at state after a reset.', drive_links.state_kept, RESET, 1, DRIVE_SHEET, DRIVES),
        Link('Drive the robot forward by hand after a reset in another direction, and look at '
             'local_x, local_y and local_yaw.', drive_pose.wrong_pose, POSE, 3, DRIVE_SHEET,
             DRIVES),
        Link('Look at the goal.', drive_links.wrong_goal, STATES, 1, DRIVE_SHEET, DRIVES),
        Link('Look at state: which command belongs to each, and when does it change?',
             drive_links.wrong_law, STATES, 1, DRIVE_SHEET, DRIVES),
        Link('rostopic echo /cmd_vel: which message is the last one at the goal, and after False?',
             drive_links.not_silent, STATES, 2, DRIVE_SHEET, CONTROL),
        Link('How large is each command?', drive_links.slow_law, STATES, 1, DRIVE_SHEET, DRIVES)),
    'gamepad': tuple(
        Link(question, check, THUMB, 1, DRIVE_SHEET, STICKS) for question, check in zip((
            'rostopic echo /joy, and /cmd_vel: which number belongs to which?',
            'rostopic echo /cmd_vel, and /ctrl_relinq: hold a stick, let it go, press A, B, Y.',
            'How large is each command?'), input_links.PAD_LINKS))}
#: lab -> variables of its node by the handout
NAMES = {'turn': {'goal_yaw', 'turning'}, 'move2goal': {'local_x', 'local_y', 'local_yaw'}}
#: What costs no points, and is told with full marks.
REMARKED = turn_links.too_seldom, input_links.mouse_in_turn


def remarks(run: Any, lab: str) -> List[str]:
    """Sentences on a node that earned everything."""
    node_run = NodeRun(run)
    return [f'{sentence(found)} See {link.place}.' for link in CHAINS[lab]
            if link.check in REMARKED for found in [link.check(node_run)] if found is not None]


def found_in(run: Any) -> List[Tuple[str, Link, BrokenLink]]:
    """(node, link, what is broken) of each node in a recording whose lab is known. A law that is
    not the handout's is not broken: the node may be right."""
    found = []
    for node in sorted(nodes_of(run)):
        node_run = NodeRun(run, node)
        names = {bare(name) for name in node_run.variables}
        lab = next((lab for lab, known in NAMES.items() if known <= names), '')
        broken = first_broken(node_run, CHAINS.get(lab, ()), weak=False)
        if broken:
            found.append((node, *broken))
    return found
