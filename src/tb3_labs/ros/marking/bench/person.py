"""The person at the bench: is told what to do, and is asked what only a person can see."""
import re
import sys
import termios

#: An answer that is none is asked for again so often.
TIMES = 3


class Person:
    """Speaks by standard output, and listens to standard input.

    Where nobody listens (the input has ended), nothing is confirmed.
    """

    def __init__(self):
        #: How many things a person was asked to do with the node so far.
        self.tasks = 0

    @staticmethod
    def tell(words):
        """Say something."""
        print(words, flush=True)

    def have(self, task):
        """Ask for something to be done with the node."""
        self.tasks += 1
        self.tell('> ' + task)

    def confirms(self, question):
        """Does the person say yes?"""
        return self._answer(question + ' [y/n] ', r'(y|yes|n|no)').startswith('y')

    def denies(self, question):
        """Does the person say no?"""
        return self._answer(question + ' [y/n] ', r'(y|yes|n|no)').startswith('n')

    def number(self, question):
        """A number that the person reads, as text; '' if there is none."""
        return self._answer(question + ' [a number, or Enter] ', r'(-?\d+(\.\d+)?)?')

    def _answer(self, question, form):
        for _ in range(TIMES):
            try:
                if sys.stdin.isatty():
                    termios.tcflush(sys.stdin, termios.TCIFLUSH)    # what was typed before
                answer = input('? ' + question).strip().lower()
            except EOFError:
                print('(no answer)', flush=True)
                return ''
            if re.fullmatch(form, answer):
                return answer
        return ''
