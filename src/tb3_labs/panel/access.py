"""The address of the page, and the check of each request of a browser.

:mod:`tb3_labs.supervision.dead_man` decides which page may drive.

A page of another site can make the browser send requests to this node, even to the address
127.0.0.1. Therefore Access checks the host, the origin and the token of each request.

The host is the name under which the browser reached this node. If a site makes its own name resolve
to 127.0.0.1 (DNS rebinding), the host is the site's name, and Access refuses the request.

The origin is the site whose page opens the socket. Access accepts only this node's own page.

The token is a part of the printed address. Only a node that other computers can reach has a token.

Sources: RFC 6454 (origins), RFC 6455 section 10.2 (websockets), RFC 7230 section 5.4 (Host).
"""
import hmac
import re
from dataclasses import dataclass
from typing import Iterable, Optional

from tb3_labs.config import Config, setting

#: Only programs of this computer can connect to this address.
LOOPBACK = '127.0.0.1'
PORT_SUFFIX = re.compile(r':[0-9]*\Z')


@dataclass(frozen=True)
class PanelConfig(Config):
    """The address of the page, and the page's permission to drive."""

    port: int = setting(8080, 'TCP port of the page; if it is in use, one of the next nine',
                        low=1, high=65000)
    address: str = setting(LOOPBACK, 'address of the page; 0.0.0.0 is every address of this host; '
                                     'any address but 127.0.0.1 needs the printed token')
    control: bool = setting(True, 'pages may drive and reset the robot; false: they only show it')
    rate: float = setting(20.0, 'pictures', unit='1/s', low=1.0, high=60.0)


class Access:
    """Checks the host, the origin and the token of requests."""

    def __init__(self, names: Iterable[str] = (), token: str = '') -> None:
        """`names` has names and addresses of this computer. Loopback names are always valid."""
        self._valid_names = {name.lower() for name in ('localhost', LOOPBACK, *names)}
        self._token = token

    def refusal_reason(self, host: Optional[str], origin: Optional[str],
                       token: Optional[str]) -> Optional[str]:
        """Returns the reason why a request is refused; None if the request is accepted.

        `host` and `origin` are headers of the request, or None if the header is missing. Only
        browsers send an origin. `token` is from the request, or None if the request needs none.
        """
        host = (host or '').lower()
        name = PORT_SUFFIX.sub('', host)
        if name not in self._valid_names:
            names = ', '.join(sorted(self._valid_names))
            return f'this page is not offered as {name!r}: use one of {names}'
        if origin is not None and origin.lower() not in ('http://' + host, 'https://' + host):
            return f'requests of pages of other sites ({origin}) are refused'
        if token is not None and not hmac.compare_digest(_as_bytes(token), _as_bytes(self._token)):
            return 'the token is missing or wrong: use the whole address that the panel printed'
        return None


def _as_bytes(text: str) -> bytes:
    """Returns a text as bytes, because hmac compares texts only if they are ASCII."""
    return text.encode(errors='surrogatepass')
