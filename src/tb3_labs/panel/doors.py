"""May this browser connect? A page of another site in the same browser must not.

A browser sends requests for any page that it shows. So the address 127.0.0.1 alone protects nothing
from pages of other sites. Three things are checked:

* *Host*, the name under which the browser reached this node. A site whose name leads to 127.0.0.1
  (DNS rebinding) has another name there.
* *Origin*, the site whose page opens the socket. It must be this node's own page.
* *The token*, if the node listens at another address than the loopback. Whoever has not seen the
  address that the node printed does not know it.

Sources: RFC 6454 (origins), RFC 6455 section 10.2 (origins of websockets), RFC 7230 section 5.4
(Host).
"""
import hmac
import re
import secrets
from typing import Iterable, Optional
from urllib.parse import urlsplit

#: Names of the loopback.
LOOPBACK_NAMES = ('localhost', '127.0.0.1', '::1')
#: A Host header: an IPv6 address in brackets, or another address or name; then a port.
HOST = re.compile(r'(?:\[([0-9a-fA-F.]*:[0-9a-fA-F:.]*)\]|([^\s\\@:/?#\[\]]+))(?::[0-9]*)?')
#: Length of a token [bytes].
TOKEN_SIZE = 12


class Doors:
    """The names of this node, and its token ('': none is needed)."""

    def __init__(self, names: Iterable[str] = (), token: str = '') -> None:
        """`names`: names and addresses of this computer, beside those of the loopback."""
        self._names = {name.lower() for name in (*LOOPBACK_NAMES, *names)}
        self._token = token

    def refusal(self, host: Optional[str], origin: Optional[str],
                token: Optional[str]) -> str:
        """'' or the reason why a request is refused.

        `host` and `origin` are its headers; None: it has none. Programs other than browsers send
        no origin. `token`: as it was given; None: this request needs none.
        """
        name = _name(host or '')
        if name not in self._names:
            return 'this page is not offered as {!r}: use one of {}'.format(
                name, ', '.join(sorted(self._names)))
        if origin is not None and not self._is_own(origin, host or ''):
            return 'requests of pages of other sites ({}) are refused'.format(origin)
        if token is not None and not hmac.compare_digest(_bytes(token), _bytes(self._token)):
            return 'the token is missing or wrong: use the whole address that the panel printed'
        return ''

    @staticmethod
    def _is_own(origin: str, host: str) -> bool:
        try:
            site = urlsplit(origin)
        except ValueError:
            return False
        return site.scheme in ('http', 'https') and site.netloc.lower() == host.lower()


def _name(host: str) -> str:
    """The name in a Host header, without its port; '' for an invalid one."""
    match = HOST.fullmatch(host)
    return (match[1] or match[2]).lower() if match else ''


def _bytes(token: str) -> bytes:
    """For the comparison, which takes no letters but ASCII; any text is possible."""
    return token.encode(errors='surrogatepass')


def new_token() -> str:
    """A token that cannot be guessed."""
    return secrets.token_urlsafe(TOKEN_SIZE)
