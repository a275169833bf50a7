"""The variables of a node on the timeline's page: what was recorded is what is drawn."""
import re

import numpy as np
import pytest
from made_run import TIME, X, made

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from test_timeline import data_of, path_in

from tb3_labs.recording.run_data import Variables
from tb3_labs.report.page import timeline


def variables(nodes=None, time=TIME, **texts):
    """Variables of a node: a name, and a text at each time, or one for all times."""
    rows = [(at, (nodes or {}).get(name, '/controller'), name,
             text if isinstance(text, str) else str(text[k]))
            for k, at in enumerate(time) for name, text in texts.items()]
    at, *columns = zip(*rows)
    return Variables(np.array(at), np.array(at), *(np.array(each, dtype=object) for each in columns))


def figures(**texts):
    return {figure.name: figure for figure in timeline.figures(made(
        variables=variables(**texts)))}


def test_the_handouts_variables_come_first_and_twelve_figures_are_drawn():
    found = list(figures(**{'a{}'.format(k): TIME + k for k in range(20)}, state=['A', 'B'] * 100 + ['A'],
                         local_x=X))
    assert found[:3] == ['local_x', 'state', 'a0'] and len(found) == 12


def test_a_state_is_steps_between_its_texts():
    figure, = figures(turning=TIME >= 4.0).values()
    assert figure.levels == ['False', 'True']
    assert figure.line == ([(0.0, 0.0), (3.95, 0.0), (4.0, 1.0), (10.0, 1.0)], [])


def test_a_silence_of_the_node_is_a_break():
    time = TIME[(TIME < 3.0) | (TIME > 5.0)]
    for figure in figures(time=time, turning=time > 5.0, error=time).values():
        points, (gap,) = figure.line
        assert [points[gap - 1][0], points[gap][0]] == pytest.approx([2.95, 5.05])


def test_what_is_no_number_is_left_out_of_a_line_of_numbers():
    texts = ['None'] * 20 + [str(at) for at in TIME[20:100]] + ['nan', 'inf'] + [str(at) for at in TIME[102:]]
    points, (gap,) = figures(goal=texts)['goal'].line
    assert points[0] == (1.0, 1.0) and [points[gap - 1][0], points[gap][0]] == [4.95, 5.1]


def test_a_constant_has_a_text_and_no_figure():
    run = made(variables=variables(K_HDG='0.1', zero=['0', '0.0'] * 100 + ['0'], goal=['0'] * 100 + ['90.5'] * 101))
    assert [figure.name for figure in timeline.figures(run)] == ['goal']
    assert timeline.texts(run) == [['K_HDG', [0.0], ['0.1']], ['zero', [0.0], ['0']],
                                   ['goal', [0.0, 5.0], ['0', '90.5']]]


def test_the_names_of_two_nodes_are_told_apart():
    run = made(variables=variables({'b': '/lab/second'}, a=TIME, b=TIME))
    assert [figure.name for figure in timeline.figures(run)] == ['controller: a', 'lab/second: b']


def test_the_page_has_the_lines_and_no_text_of_a_node_can_end_it():
    end = '</script><b>'
    page = timeline.section(data_of(made(variables=variables(
        goal=TIME ** 2, state=[end] * 100 + ['B'] * 101, **{end: TIME}))))
    (line,) = path_in(page, 'variable-1', 'variable')
    assert line[:, 1] == pytest.approx(line[:, 0] ** 2, abs=0.01) and end not in page
    assert re.search('<h3>Inside /controller</h3>', page)


@pytest.mark.parametrize('large, is_drawn', [(1e299, True), (1.7e308, False)])
def test_a_number_whose_differences_are_infinite_is_not_drawn(large, is_drawn):
    page = timeline.section(data_of(made(variables=variables(a=large * np.sin(TIME)))))
    assert ('id="curve-variable-0"' in page) is is_drawn


def test_a_page_has_forty_variables():
    run = made(variables=variables(**{f'a{k}': TIME for k in range(60)}))
    assert len(timeline.texts(run)) == 40
