"""The checkoff at the bench: the order of the turns, open criteria, prompts that are missed."""
import random
from types import SimpleNamespace

import pytest

from test_marking import TABLE, observation, stimulus
from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking import move2goal, ros_move2goal, ros_running_node, ros_stage, turn
from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.marks import LABS, points_of
from tb3_labs.marking.observation import Run
from tb3_labs.marking.open_criteria import QUESTIONS, OpenCriteria
from tb3_labs.marking.ros_checkoff import PARTS, PLAYED, RELEASES, parts_of
from tb3_labs.marking.ros_running_node import Person
from tb3_labs.marking.ros_turn import MOST_TURNS, WITH_MARGIN, next_turn

SIGNS = {'l': 1.0, 'r': -1.0}


def walk(heading, error):
    """The turns of a robot that turns by 90 degrees and ``error()``: [(begin, end, name)]."""
    left, way, step = set(turn.EACH_TURN), [], None
    for number in range(MOST_TURNS):
        step = next_turn(heading, left, number, step)
        if step is None:
            return way
        left.discard(step.name)
        end = heading + SIGNS[step.typed] * (90.0 + error())
        way.append((heading, end, step))
        heading = end % 360.0
    return None


@pytest.mark.parametrize('error', [
    lambda: 0.0, lambda: -9.0, lambda: 9.0, lambda: random.uniform(-10.0, 10.0),
    lambda: random.gauss(0.0, 0.1)])
def test_all_turns_are_reached_from_every_heading(error):
    random.seed(3)
    numbers = []
    for heading in range(0, 360, 6):
        for begin in (heading, heading + 0.05, heading - 0.05):
            way = walk(begin % 360.0, error)
            assert way is not None, begin
            numbers.append(len(way))
            for this in filter(lambda this: this[2].name, way[:WITH_MARGIN]):
                assert_is_what_its_name_says(*this)
    assert min(numbers) == 5 and sorted(numbers)[len(numbers) // 2] <= 7


def assert_is_what_its_name_says(begin, end, step):
    assert turn.EACH_TURN[step.name].typed == step.typed
    for jump, name in ((180.0, 'across 180'), (0.0, 'across 0')):
        if step.name.endswith(name):
            before, after = (difference_degrees(at, jump) for at in (begin, end))
            assert before * after <= 0.0, (begin, end, step)


# -- open criteria

def criteria_of(lab='turn', parts=('turns',)):
    criteria = LABS[lab].criteria
    return OpenCriteria(criteria, points_of(lab, TABLE), parts)


def turned(name, degrees, begin):
    rows = [[begin + 0.1 * k, 0.0, 0.0, 0.1 * k / 2.0 * degrees / 57.29578] for k in range(21)]
    return stimulus(name, begin, begin + 2.0, facts={'moved': True, 'rested': True}), rows


def test_a_criterion_is_judged_as_soon_as_it_can_be():
    board, seen = criteria_of(), observation()
    assert [v.criterion.name for v in board.look(seen)] == ['starts']
    for number, (name, turn_asked) in enumerate(turn.EACH_TURN.items()):
        done, rows = turned(name, turn_asked.asked_deg, 10.0 * number)
        seen.stimuli.append(done)
        seen.truth += rows
        seen.commands.append([10.0 * number + 0.1, 0.0, 1.5])
        judged = {v.criterion.name for v in board.look(seen)}
        assert ('left' in judged) is (name == 'l') and ('right' in judged) is (name == 'r')
        # each turn may yet be fast
        assert ('clamped' in judged) is (number == len(turn.EACH_TURN) - 1)
    assert not board.all_met        # nonsense was not typed yet
    assert board.points == (13.0, 14.0)
    seen.stimuli.append(stimulus('nonsense', 90.0, 91.0, printed='l or r'))
    assert [v.criterion.name for v in board.look(seen)] == ['answers_nonsense']
    assert board.all_met and board.points == (14.0, 14.0) and board.end(seen, 'turns') == []


def test_an_open_criterion_is_judged_at_the_end_of_its_part():
    board, seen = criteria_of(), observation()
    board.look(seen)
    judged = board.end(seen, turn.TURNS)
    assert {v.outcome for v in judged} == {Outcome.MISSED} and len(judged) == 7
    assert not board.all_met and board.points == (1.0, 14.0)


def test_a_person_is_asked_before_a_printed_line_is_missed():
    board = criteria_of('move2goal', [move2goal.RESET])
    seen = observation('move2goal', stimuli=[
        stimulus(move2goal.RESET_TO_ORIGIN, facts={'problem': ''})])
    assert [v.criterion.name for v in board.look(seen)] == ['resets']
    question, = board.questions(seen, move2goal.RESET)
    assert question is QUESTIONS['says_reset']
    seen.stimuli[0].printed += question.text
    assert [v.criterion.name for v in board.look(seen)] == ['says_reset']
    assert board.questions(seen, move2goal.RESET) == []


@pytest.mark.parametrize('lab', LABS)
def test_all_that_the_handout_asks_for_can_be_tried(lab):
    graded = {criterion.part for criterion in LABS[lab].criteria if not criterion.extra}
    assert graded <= set(PARTS[lab]) <= set(LABS[lab].parts)
    assert set(parts_of(lab, [])) == graded
    assert {topic for topic, _ in PLAYED.values()} == set(RELEASES)
    assert {name for name in QUESTIONS} <= {c.name for some in LABS.values() for c in some.criteria}
    with pytest.raises(ValueError, match='mark.py tries it'):
        parts_of('imu', ['odd samples'])


# -- prompts that a person misses

@pytest.fixture
def stage(monkeypatch):
    """A stage whose node obeys a person at the prompt of this number; a prompt does not wait."""
    monkeypatch.setattr(ros_stage, 'PATIENCE', 0.0)
    monkeypatch.setattr(ros_running_node, 'PATIENCE', 0.0)
    stage = SimpleNamespace(
        obeys=1, prompts=[], answers=[], observation=observation(), keep=lambda: None,
        node=SimpleNamespace(
            alive=True, start=lambda: True, printed=(0, 0), text_since=lambda characters: '',
            runs=[Run(0.0, end=2.0)], person=Person()))

    def tell(words):
        stage.prompts.append(words)
        if len(stage.prompts) == stage.obeys:
            stage.node.alive = False
    monkeypatch.setattr(Person, 'tell', staticmethod(tell))
    monkeypatch.setattr(Person, 'asks', lambda self, question: stage.answers.pop(0))
    stage.recorder = SimpleNamespace(
        now=1.0, moves=lambda begun: len(stage.prompts) >= stage.obeys,
        commands_since=lambda begun: [[1.9, 0.2, 0.0]])
    return stage


def typed(stage):
    """Have a turn typed; did the robot move?"""
    def act():
        stage.node.person.have('type l')
        return stage.node.person
    return ros_stage.Stage.moves_after(stage, act, 0.0)


@pytest.mark.parametrize('obeys, answers, prompts, moved', [
    (1, [], 1, True), (3, ['n', 'n'], 3, True), (3, ['n', 'y'], 2, False), (2, [''], 1, False)])
def test_a_turn_that_was_not_typed_is_asked_for_again(stage, obeys, answers, prompts, moved):
    stage.obeys, stage.answers = obeys, answers
    assert typed(stage) is moved
    assert stage.prompts == ['> type l'] * prompts and stage.answers == []


@pytest.mark.parametrize('obeys, answers, prompts, ended', [
    (1, ['y'], 1, True), (3, ['n', 'n', 'y'], 3, True), (9, [''], 1, None), (9, ['y'], 1, False)])
def test_a_ctrl_c_that_was_not_pressed_is_asked_for_again(stage, obeys, answers, prompts, ended):
    """The last question is about a traceback. A node that goes on after Ctrl+C hangs."""
    stage.obeys, stage.answers, driven = obeys, answers, []
    ros_running_node.person_ends(stage, 'Ctrl+C', set_in_motion=lambda: driven.append(1))
    assert len(driven) == prompts and stage.prompts[:prompts] == ['> Ctrl+C'] * prompts
    assert stage.observation.has('Ctrl+C') is (ended is not None)
    if ended is not None:
        assert (stage.observation.stimuli[0].facts['took'] is not None) is ended


def test_a_ctrl_c_between_the_question_and_the_answer_no_is_tried_again(stage, monkeypatch):
    def start():
        started.append(stage.node.alive)
        stage.node.alive = True
        return True

    def answers_late(person, question):
        stage.node.alive = 'Ctrl+C?' not in question
        return 'n' if 'Ctrl+C?' in question else 'y'
    started, stage.obeys, stage.node.start = [], 2, start
    monkeypatch.setattr(Person, 'asks', answers_late)
    ros_running_node.person_ends(stage, 'Ctrl+C', set_in_motion=lambda: None)
    assert started == [True, False] and stage.prompts == ['> Ctrl+C'] * 2


# -- the robot's own reset

@pytest.mark.parametrize('rests', [True, False])
def test_the_robot_is_reset_only_while_it_rests(monkeypatch, rests):
    published, missing = [], []
    publisher = SimpleNamespace(get_num_connections=lambda: 1,
                                publish=lambda *message: published.append(message))
    monkeypatch.setattr(ros_move2goal.rospy, 'Publisher', lambda *topic, **options: publisher)
    monkeypatch.setattr(ros_move2goal, 'RECALIBRATION', 0.0)
    ros_move2goal.offset(SimpleNamespace(
        node=SimpleNamespace(stop=lambda: None, start=lambda: False),
        robot=SimpleNamespace(face=lambda heading: rests),
        not_offered=lambda names, reason: missing.append((names, reason))))
    assert (() in published) is rests and bool(missing) is not rests
