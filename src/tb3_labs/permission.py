"""May this node drive? Given and taken by messages of whoever holds the robot.

A permission that is given once stands until it is taken. One that is renewed again and again (as
the gamepad does) lapses when that ends: then the holder is dead or out of reach.

Units: seconds on the receiver's clock (`now`).
"""
#: Permissions that follow each other faster than this are renewals [s],
RENEWAL = 0.6
#: if there are so many in a row.
RENEWALS = 3
#: A permission that was being renewed lapses after this silence [s].
LAPSE = 0.5


class Permission:
    """What was said last, and whether it still counts."""

    def __init__(self, granted=False):
        #: True while this node may drive.
        self.granted = granted
        self._renewed = 0
        self._told_at = None

    def told(self, granted, now):
        """A message arrived. True if that changed anything."""
        changed = granted != self.granted
        quick = self._told_at is not None and 0.0 <= now - self._told_at <= RENEWAL
        self._renewed = self._renewed + 1 if granted and not changed and quick else 0
        self.granted, self._told_at = granted, now
        return changed

    def has_lapsed(self, now):
        """Takes the permission away if it was being renewed and is no longer; True if so."""
        lapsed = self.granted and self._renewed >= RENEWALS and now - self._told_at > LAPSE
        if lapsed:
            self.granted = False
            self._renewed = 0
        return lapsed
