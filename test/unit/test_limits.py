"""Numbers kept within limits."""
import math

import pytest

from tb3_labs.geometry.angles import clamp


@pytest.mark.parametrize('value, expected', [
    (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (9.0, 2.0), (math.inf, 2.0),
    (-math.inf, -1.0)])
def test_clamp(value, expected):
    assert clamp(value, -1.0, 2.0) == expected


def test_nan_never_becomes_a_limit():
    assert math.isnan(clamp(math.nan, -1.0, 1.0))
