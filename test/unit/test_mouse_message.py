"""The mouse is found in the messages that students define."""
import pytest

from tb3_labs.marking.mouse import mouse_fields


@pytest.mark.parametrize('names, types, fields, told', [
    # the handout's
    (('header', 'status', 'xPos', 'yPos'), ('std_msgs/Header', 'std_msgs/Bool', 'float32', 'float32'),
     ('status', 'xPos', 'yPos'), []),
    # another name of the flag, and of another type; an extra number before the others
    (('name', 'activestatus', 'zPos', 'xPos', 'yPos'),
     ('string', 'bool', 'float32', 'float64', 'float64'), ('activestatus', 'xPos', 'yPos'),
     ['Your activestatus was taken for status.']),
    # the order turned: names go before positions
    (('y', 'x', 'ok', 'status'), ('float32', 'float32', 'bool', 'bool'), ('status', 'x', 'y'),
     ['Your x was taken for xPos.', 'Your y was taken for yPos.']),
    (('y_pos', 'x_pos', 'flag'), ('float32', 'float32', 'bool'), ('flag', 'x_pos', 'y_pos'),
     ['Your flag was taken for status.', 'Your x_pos was taken for xPos.',
      'Your y_pos was taken for yPos.']),
    # no names at all
    (('a', 'b', 'c'), ('std_msgs/Float32', 'float32', 'std_msgs/Bool'), ('c', 'a', 'b'),
     ['Your c was taken for status.', 'Your a was taken for xPos.', 'Your b was taken for yPos.']),
])
def test_fields_are_matched_by_name_else_by_type_and_position(names, types, fields, told):
    found = mouse_fields(names, types)
    assert (found.names, found.remarks) == (fields, told)
    assert found.types == tuple(types[names.index(name)] for name in fields)


@pytest.mark.parametrize('names, types', [
    (('xPos', 'yPos'), ('float32', 'float32')), (('status', 'xPos'), ('bool', 'float32')),
    (('status', 'xPos', 'yPos'), ('bool', 'int32', 'int32')), ((), ())])
def test_a_message_without_a_flag_or_two_numbers_holds_no_mouse(names, types):
    with pytest.raises(ValueError, match='its message has no flag and two numbers, but'):
        mouse_fields(names, types)
