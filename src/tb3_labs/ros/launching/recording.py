"""Can a recording be made where it shall be?"""
import os
import tempfile


def problem_of_folder(path):
    """One sentence on why no file can be made beside `path`, or ''."""
    folder = os.path.dirname(os.path.abspath(path))
    try:
        with tempfile.TemporaryFile(dir=folder):    # root may not write everywhere either
            return ''
    except OSError as problem:
        return 'nothing can be recorded in {} ({}): go to another folder, or bag:=PATH'.format(
            folder, problem.strerror)
