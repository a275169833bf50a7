"""A number by noisy samples: the mean of equal ones, the newest of those that say more."""
import math

import pytest

from tb3_labs.control.commands import CONTRADICTION, Estimate


def estimate_of(*samples, noise=0.1):
    estimate = Estimate()
    for sample in samples:
        estimate.add(sample, noise)
    return estimate


def test_nothing_is_known_before_the_first_sample_and_one_without_noise_is_believed():
    assert Estimate().uncertainty == math.inf
    assert estimate_of(7.0).value == 7.0
    estimate = estimate_of(1.0, 2.0, noise=0.0)
    assert (estimate.value, estimate.uncertainty) == (2.0, 0.0)


def test_of_a_number_that_does_not_change_it_is_the_mean():
    estimate = estimate_of(0.1, 0.2, 0.3, 0.4)
    assert estimate.value == pytest.approx(0.25)
    assert estimate.uncertainty == pytest.approx(0.1)       # 2 x 0.1 / sqrt(4)


def test_a_change_is_taken_over_and_its_doubt_added():
    estimate = estimate_of(1.0)
    estimate.shift(0.5, 0.1)
    assert estimate.value == 1.5
    assert estimate.uncertainty == pytest.approx(2.0 * math.hypot(0.1, 0.1))
    estimate.add(1.8, 0.1)      # now it counts twice as much as the estimate before
    assert estimate.value == pytest.approx(1.7)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('share, value', [(0.99, 0.5), (1.01, 1.0)])
def test_a_sample_that_contradicts_the_estimate_takes_its_place(share, value, sign):
    far = sign * share * CONTRADICTION * math.hypot(0.1, 0.1)
    assert estimate_of(0.0, far).value == pytest.approx(value * far)
