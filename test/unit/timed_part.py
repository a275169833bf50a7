"""A part of a node behind SampleTiming, as in the node: it gets (sample, arrival)."""
from tb3_labs.localization.localizer import Localizer, Reset
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.robot.samples import ImuSample


class TimedPart:
    """A part behind SampleTiming; all other attributes are those of the part."""

    def __init__(self, part):
        self.timing, self.part = SampleTiming(), part

    @classmethod
    def localizer(cls):
        timed = cls(None)
        timed.part = Localizer(timed.timing)
        return timed

    def __getattr__(self, name):
        return getattr(self.part, name)

    def on_imu(self, sample, now, *details):
        self.part.on_imu(self.timing.on_imu(sample, now), *details)

    def on_odometry(self, sample, now):
        self.part.on_odometry(self.timing.on_odometry(sample, now))

    def reset(self, requested, *when):
        reset = Reset(requested)
        self.part.on_reset(reset, *when)
        return reset

    def add(self, sample, now):
        """For a SampleBuffer."""
        if isinstance(sample, ImuSample):
            self.part.add_imu(self.timing.on_imu(sample, now))
        else:
            self.part.add_odometry(self.timing.on_odometry(sample, now))

    @property
    def clock(self):
        return self.timing.clock
