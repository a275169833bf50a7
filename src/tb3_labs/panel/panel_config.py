"""The settings of the node `panel`."""
from dataclasses import dataclass
from typing import List

from tb3_labs.config import Config, setting

#: The address at which only programs of this computer can connect.
LOOPBACK = '127.0.0.1'


@dataclass(frozen=True)
class PanelConfig(Config):
    """Where the page is offered, what it shows, and whether it may drive."""

    port: int = setting(8080, 'TCP port of the page; if it is in use, one of the next nine',
                        low=1, high=65000)
    address: str = setting(LOOPBACK, 'address at which the page is offered; 0.0.0.0: all; other '
                                     'than the loopback it needs the token that is printed')
    token: str = setting('', 'token of your own, where one is needed; else a new one each time')
    control: bool = setting(True, 'pages may drive and set; false: they only show')
    robots: int = setting(0, 'robots, in namespaces robot1, robot2, ...; 0: one in this namespace',
                          low=0, high=200)
    rate: float = setting(20.0, 'pictures', '1/s', 1.0, 60.0)

    @property
    def names(self) -> List[str]:
        """The namespaces of the robots; '' is the node's own."""
        return ['robot%d' % number for number in range(1, self.robots + 1)] or ['']
