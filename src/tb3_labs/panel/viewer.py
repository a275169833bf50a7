"""The pace of one page: a page that cannot keep up is dropped, and nothing is stored for it.

A page reports the number of a picture that it has drawn, once in several pictures. One that has
not drawn the last `MOST_UNSEEN` of those that were sent to it is too slow: a suspended laptop, or a
network that holds everything up. Its connection is closed. It connects anew when it runs again, and
then sees the present picture and not those of the past minutes.
"""

#: A page reports one picture in this number.
REPORT_EVERY = 10
#: A page is dropped when this number of pictures is under way: 3 s at the usual rate.
MOST_UNSEEN = 60


class Viewer:
    """Counts the pictures of one page."""

    def __init__(self) -> None:
        #: Number of the last picture that was sent; the first one is 1.
        self.sent = 0
        self._seen = 0

    def next_picture(self) -> int:
        """The number of the picture that is sent now."""
        self.sent += 1
        return self.sent

    def has_seen(self, number: int) -> None:
        """The page has drawn picture `number`; ``ValueError`` if it was not sent yet."""
        if number > self.sent:
            raise ValueError('picture {} was not sent yet: the last one is {}'.format(
                number, self.sent))
        self._seen = max(self._seen, number)

    @property
    def is_too_slow(self) -> bool:
        """Is the page to be dropped?"""
        return self.sent - self._seen >= MOST_UNSEEN
