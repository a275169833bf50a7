#!/usr/bin/env python3
"""The way to the master, for nodes whose master dies: whoever asks there is refused, as by a master
that was killed. Later the same master can be there again."""
import socket
import threading

from costs import free_port



class MasterWay:
    """Passes on to the master at `port` what arrives at `uri`, until it is cut."""

    def __init__(self, port):
        self._master, self._port = ('localhost', port), free_port()
        self.uri = 'http://localhost:{}'.format(self._port)
        self._sockets = []
        self.mend()

    def mend(self):
        """From now on the master answers."""
        door = socket.create_server(('localhost', self._port))
        self._sockets = [door]
        threading.Thread(target=self._serve, args=(door, self._sockets), daemon=True).start()

    def cut(self):
        """From now on there is no master."""
        for each in self._sockets:
            _close(each)

    def _serve(self, door, sockets):
        while True:
            try:
                near, _ = door.accept()
            except OSError:
                return      # cut
            far = socket.create_connection(self._master)
            sockets += [near, far]
            for one, other in ((near, far), (far, near)):
                threading.Thread(target=_pass_on, args=(one, other), daemon=True).start()


def _pass_on(one, other):
    try:
        data = one.recv(65536)
        while data:
            other.sendall(data)
            data = one.recv(65536)
    except OSError:
        pass
    _close(one)
    _close(other)


def _close(end):
    try:
        end.shutdown(socket.SHUT_RDWR)    # close() alone would wake nobody who waits for it
    except OSError:
        pass    # it is closed already
    end.close()
