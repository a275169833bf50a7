"""The variables of a node on the timeline's page: what was recorded is what is drawn."""
import numpy as np
import pytest
from made_run import TIME, X, made, variables

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.page import timeline


def figures(**texts):
    return {figure['name']: figure for figure in timeline.figures(made(
        variables=variables(**texts)))}


def points_of(figure):
    return [*zip(figure['time'], figure['columns'][0])]


def test_the_handouts_variables_come_first_and_twelve_figures_are_drawn():
    found = list(figures(**{'a{}'.format(k): TIME + k for k in range(20)}, state=['A', 'B'] * 100 + ['A'],
                         local_x=X))
    assert found[:3] == ['local_x', 'state', 'a0'] and len(found) == 12


def test_a_state_is_steps_between_its_texts():
    figure, = figures(turning=TIME >= 4.0).values()
    assert figure['levels'] == ['False', 'True'] and not len(figure['breaks'])
    assert points_of(figure) == [(0.0, 0.0), (3.95, 0.0), (4.0, 1.0), (10.0, 1.0)]


def test_a_silence_of_the_node_is_a_break():
    time = TIME[(TIME < 3.0) | (TIME > 5.0)]
    for figure in figures(time=time, turning=time > 5.0, error=time).values():
        (gap,), time = figure['breaks'], figure['time']
        assert [time[gap - 1], time[gap]] == pytest.approx([2.95, 5.05])


def test_what_is_no_number_is_left_out_of_a_line_of_numbers():
    texts = ['None'] * 20 + [str(at) for at in TIME[20:100]] + ['nan', 'inf'] + [str(at) for at in TIME[102:]]
    figure = figures(goal=texts)['goal']
    (gap,), points = figure['breaks'], points_of(figure)
    assert points[0] == (1.0, 1.0) and [points[gap - 1][0], points[gap][0]] == [4.95, 5.1]


def test_a_constant_has_a_text_and_no_figure():
    run = made(variables=variables(K_HDG='0.1', zero=['0', '0.0'] * 100 + ['0'], goal=['0'] * 100 + ['90.5'] * 101))
    assert [figure['name'] for figure in timeline.figures(run)] == ['goal']
    assert timeline.texts(run) == [['K_HDG', [0.0], ['0.1']], ['zero', [0.0], ['0']],
                                   ['goal', [0.0, 5.0], ['0', '90.5']]]


def test_the_names_of_two_nodes_are_told_apart():
    run = made(variables=variables({'b': '/lab/second'}, a=TIME, b=TIME))
    assert [figure['name'] for figure in timeline.figures(run)] == ['controller: a', 'lab/second: b']


@pytest.mark.parametrize('large, is_drawn', [(1e299, True), (1.7e308, False)])
def test_a_number_whose_differences_are_infinite_is_not_drawn(large, is_drawn):
    assert bool(figures(a=large * np.sin(TIME))) is is_drawn


def test_a_page_has_forty_variables():
    run = made(variables=variables(**{f'a{k}': TIME for k in range(60)}))
    assert len(timeline.texts(run)) == 40
