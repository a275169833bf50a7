"""The texts of the variables of a node on the timeline's page."""
from made_run import TIME, X, made, variables

from tb3_labs.report.page import timeline


def rows_of_run(**texts):
    """{name: [(time, text)]} of the variables of a run."""
    return {name: [*zip(times, words)] for name, times, words in timeline.variable_rows(made(
        variables=variables(**texts)))}


def test_the_handouts_variables_come_first_and_a_page_has_forty():
    found = list(rows_of_run(**{f'a{k}': TIME for k in range(60)}, state='A', local_x=X))
    assert found[:3] == ['local_x', 'state', 'a0'] and len(found) == 40


def test_a_text_is_there_once_until_it_changes_and_none_after_the_last_reading():
    assert rows_of_run(turning=TIME >= 4.0, K_HDG='0.1', zero=['0', '0.0'] * 100 + ['0'],
                       goal=['0'] * 100 + ['90.500001'] * 101) == {
        'turning': [(0.0, 'False'), (4.0, 'True'), (10.0, None)], 'K_HDG': [(0.0, '0.1'), (10.0, None)],
        'zero': [(0.0, '0'), (10.0, None)], 'goal': [(0.0, '0'), (5.0, '90.5'), (10.0, None)]}


def test_a_silence_of_the_node_has_no_text():
    time = TIME[(TIME < 3.0) | (TIME > 5.0)]
    assert rows_of_run(time=time, turning='True')['turning'] == [
        (0.0, 'True'), (2.95, None), (5.05, 'True'), (10.0, None)]


def test_the_names_of_two_nodes_are_told_apart():
    run = made(variables=variables({'b': '/lab/second'}, a=TIME, b=TIME))
    assert [row[0] for row in timeline.variable_rows(run)] == ['controller: a', 'lab/second: b']
