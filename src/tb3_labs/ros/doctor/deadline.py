"""Calls that are given up after a time, whatever they wait for."""
import queue
import threading
import time


def within(seconds, function, *arguments):
    """What ``function(*arguments)`` returns or raises; TimeoutError if it takes longer than that.
    """
    return together(seconds, [(function,) + arguments])[0].result()


class Outcome:
    """What a call returned or raised."""

    def __init__(self, value=None, problem=None):
        self._value, self._problem = value, problem

    def result(self):
        """The value; or it raises what the call raised."""
        if self._problem is not None:
            raise self._problem
        return self._value

    def or_none(self):
        """The value; None if the call took too long, or met a problem of the network."""
        try:
            return self.result()
        except (OSError, UnicodeError):    # a TimeoutError is an OSError
            return None


def together(seconds, calls):
    """The Outcome of each call, in order; ``calls``: tuples of a function and its arguments. All
    run at the same time. Those that take longer end in a TimeoutError, and are left behind."""
    done = queue.Queue()

    def run(number, function, arguments):
        try:
            done.put((number, Outcome(function(*arguments))))
        except Exception as problem:    # whatever it is, it is raised where the result is asked for
            done.put((number, Outcome(problem=problem)))

    for number, (function, *arguments) in enumerate(calls):
        threading.Thread(target=run, args=(number, function, arguments), daemon=True).start()
    outcomes = [Outcome(problem=TimeoutError('no answer within {:.1f} s'.format(seconds)))
                for _ in calls]
    end = time.monotonic() + seconds
    for _ in calls:
        try:
            number, outcome = done.get(timeout=max(0.0, end - time.monotonic()))
        except queue.Empty:
            break
        outcomes[number] = outcome
    return outcomes
