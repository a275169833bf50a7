"""Settings that describe and check themselves.

A configuration is a frozen dataclass that refuses an invalid value with one sentence. The folder
`ros` uses the fields to read, document and change ROS parameters.
"""
import difflib
from dataclasses import Field, dataclass, field, fields
from typing import Any, Iterable, Mapping, Optional, Sequence, Type, TypeVar

NOT_GIVEN = 'default'    # the value of a parameter that was not given
TYPE_TEXTS = {bool: 'true or false', float: 'a number', int: 'a whole number', str: 'text'}
ConfigType = TypeVar('ConfigType', bound='Config')


def setting(default: Any, meaning: str, unit: str = '', low: Optional[float] = None,
            high: Optional[float] = None, choices: Optional[Sequence] = None) -> Any:
    """Returns a dataclass field. A number needs `low` and `high`, its extreme valid values."""
    return field(default=default, metadata={
        'meaning': meaning, 'unit': unit, 'low': low, 'high': high, 'choices': choices})


@dataclass(frozen=True)
class Config:
    """The base of all configurations. It checks each field that :func:`setting` made."""

    def __post_init__(self) -> None:
        for item in fields(self):
            if 'meaning' in item.metadata:
                object.__setattr__(self, item.name, _checked_value(item, getattr(self, item.name)))


def from_parameters(config_type: Type[ConfigType], given: Mapping[str, Any]) -> ConfigType:
    """Returns a `config_type` with the values `given`. Unknown parameters, and parameters with the
    value NOT_GIVEN, are ignored. Raises ``ValueError`` for the first invalid value."""
    names = {item.name for item in fields(config_type)}
    return config_type(**{name: value for name, value in given.items()
                          if name in names and value != NOT_GIVEN})


def spelling_hint(name: str, valid_names: Iterable[str]) -> str:
    """Returns a hint for a `name` that is not in `valid_names`."""
    similar = difflib.get_close_matches(name, list(valid_names), n=1)
    return f'is {similar[0]} meant?' if similar else 'known: ' + ', '.join(sorted(valid_names))


def _checked_value(item: Field, value: Any) -> Any:
    """Returns `value` in the field's type. Raises ``ValueError`` if `value` is not valid."""
    valid_type = type(item.default)
    rule = item.metadata
    # types are compared exactly, because a bool is also an int, but a rate "true" is wrong
    if valid_type is float and type(value) is int:
        value = float(value)
    is_valid = type(value) is valid_type
    if is_valid and valid_type in (int, float):
        is_valid = rule['low'] <= value <= rule['high']    # False for NaN
    if is_valid and rule['choices']:
        is_valid = value in rule['choices']
    if not is_valid:
        raise ValueError(f'{item.name} = {value!r} is not valid: {valid_values_text(item)}')
    return value


def valid_values_text(item: Field) -> str:
    """Returns a text about the valid values of a field, such as 'a number from 0 to 10 rad/s'."""
    rule = item.metadata
    if rule['choices']:
        return 'one of ' + ', '.join(str(choice) for choice in rule['choices'])
    text = TYPE_TEXTS[type(item.default)]
    if rule['low'] is not None:    # ten digits are enough for each whole number of 32 bits
        text += f' from {rule["low"]:.10g} to {rule["high"]:.10g}'
    return f'{text} {rule["unit"]}'.rstrip()
