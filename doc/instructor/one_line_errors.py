"""Makes a program report each error in one line instead of a traceback. A program of this folder
imports this module first, because an instructor edits the files that the program reads.

The message of a ``raise`` statement explains its error. For any other error, the line also names
the place in the code."""
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
