"""An invisible screen whose mouse the tests move."""
import os
import subprocess


class VirtualScreen:
    """A separate X server (Xvfb). `display` is its value of DISPLAY."""

    def __init__(self, width, height):
        read, write = os.pipe()
        # without -noreset the server resets when its last program ends, and refuses a program that comes meanwhile
        self._server = subprocess.Popen(
            ['Xvfb', '-noreset', '-displayfd', str(write), '-screen', '0',
             '{}x{}x24'.format(width, height), '+extension', 'GLX'],
            pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as number:
            self.display = ':' + number.readline().strip()

    def close(self):
        """End the server. Programs on this screen lose their display."""
        self._server.kill()
        self._server.wait()
