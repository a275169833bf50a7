"""From bag files to pages: of one run, or of several side by side."""
import math
from pathlib import Path

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.compare import summarize, write_comparison
from tb3_labs.report.completed import LAB_GOAL, completed
from tb3_labs.report.page import write_report
from tb3_labs.ros.bags.reader import read_run
from tb3_labs.ros.bags.topics import BagProblem


def write(bags, folder, model, namespace, goal, step):
    """(The page, [problem]) of the files `bags`. The page is None if none of them can be read.

    `folder`: where to; None: beside the first bag. `goal`: (x [m], y [m], yaw [deg]) or None.
    ``step(what)`` gives a function that takes the share of `what` that is done. ``OSError`` if
    nothing can be written.
    """
    goal = LAB_GOAL if goal is None else Pose2(goal[0], goal[1], wrap(math.radians(goal[2])))
    bags, pages, summaries, problems = [Path(bag) for bag in bags], [], [], []
    several = len(bags) > 1
    names = names_of(bags)
    if folder is None:
        folder = bags[0].with_name('runs_report') if several else (
            bags[0].with_name(bags[0].stem + '_report'))
    folder = Path(folder)
    for bag, name in zip(bags, names):
        part = ' ' + name if several else ''
        try:
            run = completed(read_run(str(bag), namespace, step('reading' + part)), goal)
        except BagProblem as problem:
            problems.append(str(problem))
            continue
        own = folder / name if several else folder
        pages.append(write_report(run, model, own, step('drawing' + part)))
        if several:
            summaries.append(summarize(run, model, name, name + '/report.html'))
    if several and pages:
        return write_comparison(summaries, folder, problems), problems
    return (pages[0] if pages else None), problems


def names_of(bags):
    """A name for each run, which is also its folder: its file's, with a number if it is not the
    only one."""
    names = []
    for bag in bags:
        alike = sum(other.stem == bag.stem for other in bags[:len(names)])
        names.append(bag.stem + ('_{}'.format(alike + 1) if alike else ''))
    return names
