"""A program that imports this module first reports each error in one line, because an instructor
edits the files that the programs of this folder read.

A ``raise`` statement explains an error itself. The line on any other error has its place."""
import os
import sys
import traceback


def print_in_one_line(kind, error, trace):
    """Print an error. Python calls this function in place of printing a traceback."""
    reason = ' '.join(str(error).split()) or kind.__name__
    place = traceback.extract_tb(trace)[-1]
    if isinstance(error, ModuleNotFoundError):
        reason += ': type source scripts/setup.sh first'
    elif isinstance(error, OSError) and error.filename:
        reason = f'{error.filename}: {error.strerror}'
    elif not (isinstance(error, SyntaxError) or place.line.startswith('raise ')):
        file = os.path.relpath(os.path.realpath(place.filename))
        reason += f' ({file}, line {place.lineno}: {place.line})'
    sys.stderr.write(f'{os.path.basename(sys.argv[0])}: {reason}\n')


sys.excepthook = print_in_one_line
