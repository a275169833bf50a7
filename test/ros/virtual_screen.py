"""An invisible screen: tests read its picture, and move its mouse."""
import os
import subprocess
import tempfile

import numpy as np


class VirtualScreen:
    """An X server of its own (Xvfb); `display` is its name for DISPLAY."""

    def __init__(self, width, height):
        self._folder = tempfile.TemporaryDirectory()    # for its picture
        read, write = os.pipe()
        self._server = subprocess.Popen(
            ['Xvfb', '-displayfd', str(write), '-fbdir', self._folder.name, '-screen', '0',
             '{}x{}x24'.format(width, height), '+extension', 'GLX'],
            pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as number:
            self.display = ':' + number.readline().strip()

    def pixels(self):
        """The picture on the screen: an array (height, width, 3) of red, green, blue, 0 to 255."""
        picture = np.memmap(os.path.join(self._folder.name, 'Xvfb_screen0'), mode='r')
        header = picture[:100].view('>u4')              # of an X window dump, see XWDFile.h
        begin, width, height, line = header[0] + 12 * header[19], header[4], header[5], header[12]
        rows = picture[begin:begin + height * line].reshape(height, line)
        return rows[:, :4 * width].reshape(height, width, 4)[:, :, 2::-1].copy()

    def close(self):
        """End the server; programs that use it lose their display."""
        self._server.kill()
        self._server.wait()
        self._folder.cleanup()
