"""A part of a node behind a door of samples, as in the node: it hears (sample, arrival)."""
from tb3_labs.localization.door import Door
from tb3_labs.localization.localizer import Localizer, Reset
from tb3_labs.robot.samples import ImuSample


class AtDoor:
    """A part, all of whose other attributes are its own."""

    def __init__(self, part):
        self.door, self.part = Door(), part

    @classmethod
    def localizer(cls):
        """A Localizer."""
        ear = cls(None)
        ear.part = Localizer(ear.door)
        return ear

    def __getattr__(self, name):
        return getattr(self.part, name)

    def on_imu(self, sample, now, *details):
        self.part.on_imu(self.door.hear_imu(sample, now), *details)

    def on_odometry(self, sample, now):
        self.part.on_odometry(self.door.hear_odometry(sample, now))

    def reset(self, asked, *when):
        """A Reset to an AskedPose."""
        reset = Reset(asked)
        self.part.on_reset(reset, *when)
        return reset

    def add(self, sample, now):
        """For a SampleBuffer."""
        if isinstance(sample, ImuSample):
            self.part.add_imu(self.door.hear_imu(sample, now))
        else:
            self.part.add_odometry(self.door.hear_odometry(sample, now))

    @property
    def clock(self):
        return self.door.clock
