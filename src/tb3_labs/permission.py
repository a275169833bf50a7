"""May this node drive? Given and taken by messages of whoever holds the robot.

A permission that is given once stands until it is taken. One that is renewed again and again (as
the gamepad does) lapses when that ends: then the holder is dead or out of reach.

Units: seconds on the receiver's clock (`now`).
"""
#: A permission that follows another one faster than this is a renewal; no hand is that quick [s].
RENEWAL = 0.3
#: A permission that was being renewed lapses after this silence [s].
LAPSE = 0.5


class Permission:
    """What was said last, and whether it still counts."""

    def __init__(self, granted=False):
        #: True while this node may drive.
        self.granted = granted
        self._is_renewed = False
        self._told_at = None

    def told(self, granted, now, will_be_renewed=False):
        """A message arrived, from one who says that it will be renewed or not. True if that changed
        anything."""
        changed = granted != self.granted
        quick = self._told_at is not None and 0.0 <= now - self._told_at <= RENEWAL
        self._is_renewed = granted and (
            will_be_renewed or (not changed and (quick or self._is_renewed)))
        self.granted, self._told_at = granted, now
        return changed

    def has_lapsed(self, now):
        """Takes the permission away if it was being renewed and is no longer; True if so."""
        lapsed = self.granted and self._is_renewed and now - self._told_at > LAPSE
        if lapsed:
            self.granted = self._is_renewed = False
        return lapsed
