"""What a driver is asked, for the tests; and a server that answers as it is told."""

import socket
import threading
from contextlib import suppress
from dataclasses import replace
from itertools import chain, cycle

import numpy as np

from bridgegen.drivers.interface import (
    ROUTE_POINTS,
    Conflicts,
    Lane,
    Light,
    MapView,
    Observation,
    RoadMap,
    Scene,
)
from bridgegen.drivers.remote.messages import pack

N = 3


def scene(**changed):
    kinds = np.zeros(1, np.int64)
    return Scene(0.05, 400, ("bv",), kinds, 4.5, 1.8, 1.4, 50.0, 3.0, 8.0, 0.2, **changed)


def observation(running=(True, True, True), **changed):
    one = np.arange(N, dtype=np.float64)
    plain = Observation(
        time=0.0, running=np.array(running), x=one, y=one, h=one, v=one, a=one,
        target_speed=one + 1.0, offset=one, route=np.zeros((N, ROUTE_POINTS, 4)),
        tracks=np.zeros((N, 1, 13)), stop_distance=np.full(N, np.inf), light=np.zeros(N, np.int8),
    )  # fmt: skip
    return replace(plain, **changed)


def road_map():
    line = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    lane = Lane(
        "1:0:-1", "driving", line, line[:, :2] + 1.75, line[:, :2] - 1.75, np.full(2, np.inf), "",
        (), (), "1:0:1", "", False, False, "solid", "none", False, False,
    )  # fmt: skip
    return RoadMap(
        lanes=(lane,), route=("1:0:-1",), crosswalks=(np.zeros((4, 2)),),
        lights=(Light("7", ("1:0:-1",), np.zeros((2, 2))),), pieces=np.zeros((1, 11, 3)),
        piece_points=np.full(1, 2), piece_kind=np.zeros(1, np.int8),
        piece_lane=np.zeros(1, np.int64), piece_light=np.full(1, -1),
        piece_marking=np.zeros(1, np.int8),
    )  # fmt: skip


def with_all():
    """A scene and an observation with what a driver may want."""
    view = MapView(np.zeros(N, np.int64), np.full((N, 4), -1, np.int32), np.ones((N, 1), np.int8))
    return scene(maps=(road_map(),), map_of=np.zeros(N, np.int64)), observation(
        map=view,
        conflicts=Conflicts(np.full((N, 1, 2, 6), np.nan)),
        history=np.zeros((N, 1, 11, 13)),
    )


HELLO = pack({"type": "hello", "protocol": 1, "name": "a test"})
READY = pack({"type": "ready"})
CONTROL = pack({"type": "control", "acceleration": np.ones(N), "curvature": np.zeros(N)})


class Server:
    """Answers a greeting, and then what it is asked with given bytes, again and again.

    None closes the connection.
    """

    def __init__(self, *answers, address=("127.0.0.1", 0)):
        self.listener = socket.create_server(address)
        self.address, self.answers = self.listener.getsockname(), answers
        self.connections = []
        threading.Thread(target=self.accept, daemon=True).start()

    @property
    def spec(self):
        return "connect:{}:{}".format(*self.address)

    def accept(self):
        with suppress(OSError):
            while True:
                connection, _ = self.listener.accept()
                self.connections.append(connection)
                threading.Thread(target=self.attend, args=(connection,), daemon=True).start()

    def attend(self, connection):
        with suppress(OSError):
            hello, *rest = self.answers
            for answer in chain([hello], cycle(rest)):
                head = connection.recv(4, socket.MSG_WAITALL)
                connection.recv(int.from_bytes(head, "little"), socket.MSG_WAITALL)
                if answer is None or not head:
                    break
                connection.sendall(answer)
            connection.shutdown(socket.SHUT_RDWR)

    def close(self):
        for one in (self.listener, *self.connections):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
