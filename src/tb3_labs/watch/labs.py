"""The chains of the labs, and the variables by which a lab's node is known."""
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from tb3_labs.watch import turn_links
from tb3_labs.watch.chain import Broken, Inside, Link, first_broken
from tb3_labs.watch.variables import bare

#: lab -> its links, in their order
CHAINS: Dict[str, Sequence[Link]] = {'turn': turn_links.LINKS}
#: lab -> variables of its node by the handout
NAMES = {'turn': {'goal_yaw', 'turning'}}


def found_in(run: Any) -> List[Tuple[str, Link, Broken]]:
    """(node, link, what is broken) of each node in a recording whose lab is known. A law that is
    not the handout's is not broken: the node may be right."""
    found = []
    for node in np.unique(run.variables.node.astype(str)):
        inside = Inside(run, node)
        names = {bare(name) for name in inside.variables}
        lab = next((lab for lab, known in NAMES.items() if known <= names), '')
        broken = first_broken(inside, CHAINS.get(lab, ()), weak=False)
        if broken:
            found.append((str(node), *broken))
    return found
