"""Estimates a changing number from noisy samples, by the filter of R. E. Kalman, A new approach to
linear filtering and prediction problems (1960), for one number.
"""
import math

#: In 95 of 100 cases the true value is within two standard deviations of the estimate.
STANDARD_ERRORS = 2.0
#: A sample that is this many standard deviations away contradicts the estimate.
CONTRADICTION = 4.0


class Estimate:
    """The mean of the samples if the number stays; if it changes, later samples count more."""

    def __init__(self) -> None:
        #: The estimate; 0 before the first sample.
        self.value = 0.0
        self._variance = math.inf

    @property
    def uncertainty(self) -> float:
        """The likely bound of the estimate's error; see STANDARD_ERRORS."""
        return STANDARD_ERRORS * math.sqrt(self._variance)

    def shift(self, by: float, doubt: float = 0.0) -> None:
        """The number has changed by `by`; `doubt` is the standard deviation of `by`."""
        self.value += by
        self._variance += doubt * doubt    # for a large doubt ** would raise, * gives infinity

    def add(self, sample: float, noise: float) -> None:
        """Take in a sample with the standard deviation `noise`.

        A sample that contradicts the estimate, or has no noise, replaces the estimate.
        """
        spread = noise * noise
        surprise = abs(sample - self.value)
        known = spread > 0.0 and surprise <= CONTRADICTION * math.sqrt(self._variance + spread)
        share = 1.0
        if known and math.isfinite(self._variance):
            share = self._variance / (self._variance + spread)
        self.value += share * (sample - self.value)
        self._variance = share * spread
