"""Lists the checks of each lab."""
from typing import Any, Dict, List, Sequence, Tuple

from tb3_labs.watch import drive_mistakes, drive_pose, headings, turn_mistakes
from tb3_labs.watch.mistake import Check, Mistake, NodeRun, SheetStep, find_first_mistake
from tb3_labs.watch.variables import bare_name

IMU_SHEET, TRANSFORMATION_SHEET = 'imu_lab.md', 'transformation_lab.md'
HEADING_SECTION = SheetStep(IMU_SHEET, '2. Exercise: the heading')
TURN_SECTION = SheetStep(IMU_SHEET, '3. Lab: turn 90 and 180 degrees')
LOCAL_POSE_SECTION = SheetStep(TRANSFORMATION_SHEET, '1. The local pose')
STATES_SECTION = SheetStep(TRANSFORMATION_SHEET, '2. The four states')
RESET_SECTION = SheetStep(TRANSFORMATION_SHEET, '3. The reset')
GAMEPAD_SECTION = SheetStep(TRANSFORMATION_SHEET, '4. By thumb')
TURN_STEP = TURN_SECTION.at_step(5)
DRIVE_STEP = STATES_SECTION.at_step(1)
CONTROL_STEP = STATES_SECTION.at_step(2)
TURN_PARTS = ('turns', 'both')
DRIVE_PARTS = ('drive', 'reset')
CONTROL_PARTS = (*DRIVE_PARTS, 'control')
#: {lab: checks of a node's numbers, in the order in which the node computes them}. The labs of the
#: gamepad and the mouse need no checks. Each criterion of these labs is about one input, so the
#: sentence of the criterion already names the mistake.
CHECKS: Dict[str, Sequence[Check]] = {
    'imu': (
        Check('Turn the robot once around by hand: over which range does the printed number run, '
              'and which way?', headings.find_wrong_printed_heading, HEADING_SECTION.at_step(3),
              ('heading',)),),
    'turn': (
        Check('Look at curr_yaw while you turn the robot once around by hand.',
              turn_mistakes.find_wrong_heading, TURN_SECTION.at_step(4), TURN_PARTS),
        Check('Look at goal_yaw: which one does each letter give, at which curr_yaw?',
              turn_mistakes.find_wrong_goal_yaw, TURN_STEP, TURN_PARTS),
        Check('rostopic hz /cmd_vel: how often does a command come, and who sends it?',
              turn_mistakes.find_slow_turn_commands, TURN_STEP, TURN_PARTS, is_remarked=True),
        Check('Look at turning: when does it become True, and when False?',
              turn_mistakes.find_ignored_letter, TURN_STEP, TURN_PARTS),
        Check('Which command belongs to an error of 90, of -90, of 270?',
              turn_mistakes.find_wrong_turn_command, TURN_STEP, TURN_PARTS),
        Check('At which error does a turn end, and by which command?',
              turn_mistakes.find_wrong_stop, TURN_STEP, TURN_PARTS)),
    'move2goal': (
        Check('Look at has_control: when does it become True, and when False?',
              drive_mistakes.find_wrong_control, CONTROL_STEP, CONTROL_PARTS),
        Check('Look at state after a reset.',
              drive_mistakes.find_unreset_state, RESET_SECTION.at_step(1), DRIVE_PARTS),
        Check('Drive the robot forward by hand after a reset in another direction, and look at '
              'local_x, local_y and local_yaw.', drive_pose.find_wrong_pose,
              LOCAL_POSE_SECTION.at_step(3), DRIVE_PARTS),
        Check('Look at the goal.', drive_mistakes.find_wrong_goal, DRIVE_STEP, DRIVE_PARTS),
        Check('Look at state: which command belongs to each, and when does it change?',
              drive_mistakes.find_wrong_law, DRIVE_STEP, DRIVE_PARTS),
        Check('rostopic echo /cmd_vel: which message is the last one at the goal, and after False?',
              drive_mistakes.find_late_commands, CONTROL_STEP, CONTROL_PARTS),
        Check('rostopic hz /cmd_vel: how often does a command come?',
              drive_mistakes.find_slow_drive_commands, DRIVE_STEP, DRIVE_PARTS, is_remarked=True))}
#: {lab: variables of the handout}. A node that has all of these variables belongs to the lab.
VARIABLES_OF_LAB = {'turn': {'goal_yaw', 'turning'},
                    'move2goal': {'local_x', 'local_y', 'local_yaw'}}


def remarks(recording: Any, lab: str) -> List[str]:
    """Returns a list with a sentence on the first mistake of the remarked checks, or []."""
    remarked_checks = [check for check in CHECKS.get(lab, ()) if check.is_remarked]
    mistake = find_first_mistake(NodeRun(recording), remarked_checks)
    return [] if mistake is None else [f'{mistake.as_sentence()} See {mistake.sheet_step}.']


def mistakes_of_nodes(recording: Any) -> List[Tuple[str, Mistake]]:
    """Returns (node, first mistake) for each node of a known lab that has a mistake."""
    mistakes = []
    for node in sorted(set(recording.variables.node)):
        node_run = NodeRun(recording, node)
        names = {bare_name(name) for name in node_run.variables}
        for lab, known_names in VARIABLES_OF_LAB.items():
            if known_names <= names:
                mistake = find_first_mistake(node_run, CHECKS[lab])
                if mistake is not None:
                    mistakes.append((node, mistake))
    return mistakes
