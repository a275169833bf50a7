"""Configurations that check themselves: every refusal names field, value and bound."""
import math
from dataclasses import dataclass

import pytest

from tb3_labs.config import Config, from_parameters, setting, spelling_hint


@dataclass(frozen=True)
class ExampleConfig(Config):
    """One field of each kind."""

    rate: float = setting(1.5, 'fastest turn', unit='rad/s', low=0.0, high=10.0)
    tries: int = setting(3, 'how often', low=1, high=5)
    on: bool = setting(False, 'a switch')
    law: str = setting('precise', 'which law', choices=('precise', 'lab'))
    label: str = setting('', 'any text')
    plain: float = 7.0


@pytest.mark.parametrize('name, value', [
    ('rate', 0.0), ('rate', 10.0), ('tries', 1), ('tries', 5), ('on', True), ('law', 'lab'), ('label', 'x'),
    ('plain', 'anything')])           # a field that is not made by setting()
def test_bounds_are_closed(name, value):
    assert getattr(ExampleConfig(**{name: value}), name) == value


@pytest.mark.parametrize('name, value, valid', [
    *[('rate', value, 'a number from 0 to 10 rad/s') for value in (
        -0.001, 10.001, math.nan, -math.inf, True, '1.5', None)],
    *[('tries', value, 'a whole number from 1 to 5') for value in (0, 6, 3.0, True)],
    *[('on', value, 'true or false') for value in (1, 'true')],
    *[('law', value, 'one of precise, lab') for value in ('fast', 1)], ('label', 5, 'text')])
def test_a_refusal_names_field_value_and_bound(name, value, valid):
    with pytest.raises(ValueError) as caught:
        ExampleConfig(**{name: value})
    assert str(caught.value) == '{} = {!r} is not valid: {}'.format(name, value, valid)


def test_parameters_make_a_configuration():
    given = {'rate': 2, 'law': 'default', 'somebody_elses': 'x'}
    made = from_parameters(ExampleConfig, given)
    assert made == ExampleConfig(rate=2.0) and type(made.rate) is float
    with pytest.raises(ValueError, match="law = 'fast' is not valid"):
        from_parameters(ExampleConfig, {'law': 'fast'})


def test_a_name_that_is_unknown_gets_the_nearest_one():
    assert spelling_hint('rat', ['tries', 'rate', 'law']) == 'is rate meant?'
    assert spelling_hint('xyz', ['tries', 'rate', 'law']) == 'known: law, rate, tries'
