"""The private parts of roslaunch that this package reads, each behind one function.

They were read in the sources of roslaunch 1.15.15 (Debian 12), and the tests ran with those. Each
docstring tells the failure if its part changes.
"""
import contextlib
import io
from typing import Any, List, NamedTuple, Optional

import roslaunch
import roslaunch.rlutil


class Options(NamedTuple):
    """A command line of roslaunch, taken apart."""

    options: Any
    files: List[str]


def read_options(words: List[str]) -> Optional[Options]:
    """The Options of the words that follow `roslaunch`; None if roslaunch would refuse them.

    Without `_get_optparse` each launch says that it was not checked, and goes on.
    """
    parser = roslaunch._get_optparse()
    try:
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            options, rest = parser.parse_args(list(words))
            return Options(options, roslaunch.rlutil.resolve_launch_arguments(rest))
    except (SystemExit, roslaunch.RLException):
        return None


def only_lists(options: Any) -> bool:
    """Does it only print what is in the files, or start no launch file of its own?

    If an option's name changes, each launch says that it was not checked, and goes on.
    """
    return any((options.file_list, options.node_args, options.node_list, options.find_node,
                options.dump_params, options.ros_args, options.child_name, options.core))
