"""BridgeGen's end: what it makes of servers and programs, good and bad."""

import errno
import os
import shlex
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.remote.asked import CONTROL, HELLO, READY, N, Server, observation, scene, with_all

from bridgegen.base.errors import InputError
from bridgegen.drivers import get
from bridgegen.drivers.address import address_of
from bridgegen.drivers.driver_process import DriverError, DriverProcess
from bridgegen.drivers.remote import process as remote_process
from bridgegen.drivers.remote import serve
from bridgegen.drivers.remote.messages import pack
from bridgegen.drivers.remote.wire import ClosedError, connected

HERE = Path(__file__).parent
DRIVERS = HERE.parent / "drivers.py"
SERVE = shlex.join([sys.executable, "-m", "bridgegen.drivers.remote"])
TRAJECTORY = {"time": np.ones(1), **dict.fromkeys("xyhv", np.zeros((N, 1)))}


@pytest.fixture
def driver():
    made = []

    def make(spec, **kwargs):
        made.append(DriverProcess(spec, **kwargs))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.fixture
def server():
    made = []

    def make(*answers, **kwargs):
        made.append(Server(*answers, **kwargs))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.fixture
def served():
    """Servers of Python classes; their address when they listen."""
    made = []

    def make(name, address="127.0.0.1:0"):
        one = subprocess.Popen(
            [sys.executable, "-m", "bridgegen.drivers.remote", name, address],
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        made.append(one)
        line = one.stderr.readline()
        assert line.startswith("serving on ")
        where = line.split()[-1]
        return one, where if where.startswith("unix:") else f"connect:{where}"

    yield make
    for one in made:
        one.kill()
        one.wait()
        one.stderr.close()


def command(name, file=DRIVERS):
    return f"exec:{SERVE} {shlex.quote(f'{file}:{name}')}"


@pytest.mark.parametrize("address", ["127.0.0.1:0", "[::1]:0", "unix"])
def test_a_server_is_asked_again_and_again(served, driver, tmp_path, address):
    where = f"unix:{tmp_path / 'socket'}" if address == "unix" else address
    if ":" in address and "[" in address and not socket.has_ipv6:
        pytest.skip("no IPv6")
    _, spec = served(f"{DRIVERS}:Cruises", where)
    for _ in range(2):
        one = driver(spec)
        one.reset(N, scene())
        for _ in range(3):
            acceleration, curvature = one.act(observation())
            assert acceleration.tolist() == [1.0, 1.0, 1.0]
            assert curvature.tolist() == [0.0, 0.0, 0.0]
        one.close()


def test_a_unix_socket_that_an_earlier_server_left_is_taken(served, driver, tmp_path):
    address = f"unix:{tmp_path / 'socket'}"
    first, spec = served(f"{DRIVERS}:Cruises", address)
    first.kill()
    first.wait()
    assert (tmp_path / "socket").exists()
    served(f"{DRIVERS}:Cruises", address)
    driver(spec).reset(N, scene())


def test_two_connections_are_two_drivers(served, driver):
    _, spec = served(f"{DRIVERS}:Remembers")
    for one in (driver(spec), driver(spec)):
        one.reset(N, scene())  # of a first batch; a second one is driven at half the speed
        assert one.act(observation())[0].tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("name", "kind", "message"),
    [
        ("Prints", "", ""),
        ("Raises", "raised", "drivers.py"),
        ("Hangs", "timed out", "0.5 s"),
        ("Dies", "died", "process"),
        ("AnswersNaN", "answered nonsense", "acceleration"),
        ("AnswersOneNumber", "answered nonsense", "shape"),
        ("AnswersNothing", "answered nonsense", "Control"),
    ],
)
def test_a_program_fails_as_a_class_does(driver, name, kind, message):
    one = driver(command(name), time_limit=0.5)
    one.start()
    for _ in range(2):
        one.reset(N, scene())
        if not kind:
            assert one.act(observation())[0].tolist() == [1.0, 1.0, 1.0]
            continue
        with refuses(DriverError, message) as error:
            one.act(observation())
        assert error.value.kind == kind


@pytest.mark.parametrize(
    ("answer", "kind", "message"),
    [
        (CONTROL[:20], "timed out", "0.3 s"),
        (b"", "timed out", "0.3 s"),
        (None, "died", "connection"),
        (b"HTTP/1.1 400 Bad Request\r\n", "answered nonsense", "64 MiB"),
        (b"\x00\x00\x00\x40", "answered nonsense", "1024.0"),
        (b"\x01\x00\x00\x00\xc1", "answered nonsense", "message"),
        (CONTROL + b"!", "answered nonsense", "message"),
        (READY, "answered nonsense", "control"),
        (
            pack({"type": "control", "acceleration": 1.0, "curvature": 2.0}),
            "answered nonsense",
            "acceleration",
        ),
        (
            pack({"type": "control", "acceleration": np.ones(2), "curvature": np.zeros(3)}),
            "answered nonsense",
            "acceleration",
        ),
        (
            pack({"type": "control", "acceleration": np.full(N, np.inf), "curvature": np.ones(N)}),
            "answered nonsense",
            "acceleration",
        ),
        (
            pack({"type": "control", "acceleration": np.ones(N), "curvature": [{}] * 2000}),
            "answered nonsense",
            "too large",
        ),
        (
            pack({"type": "error", "message": "out of \x1b[31m\nideas"}),
            "raised",
            "ideas",
        ),
        (pack({"type": "error", "message": "x" * 10**6}), "raised", "x" * 500),
    ],
)
def test_a_bad_answer_costs_one_clear_error(server, driver, answer, kind, message):
    """And the server can be asked again."""
    one = driver(server(HELLO, READY, answer).spec, time_limit=0.3)
    for _ in range(2):
        one.reset(N, scene())
        with refuses(DriverError, message) as error:
            one.act(observation())
        assert error.value.kind == kind
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("hello", "message"),
    [
        ({"protocol": 2}, "version 2"),
        ({"protocol": True}, "protocol"),
        ({"type": "ready"}, "hello"),
        ({"type": "error", "message": "no weights"}, "weights"),
        ({"wants": ["maps"]}, "maps"),
        ({"wants": [{}]}, "wants"),
        ({"period": float("nan")}, "period"),
        ({"max_rows": 0}, "max_rows"),
    ],
)
def test_a_server_that_greets_otherwise_is_an_error_of_the_users(server, driver, hello, message):
    spec = server(pack({"type": "hello", "protocol": 1, "name": "a test", **hello})).spec
    with refuses(InputError, message) as error:
        driver(spec).start()
    assert len(error.value.problems) == 1
    assert spec in str(error.value)


def test_a_greeting_says_what_the_driver_wants(driver):
    one = driver(command("Plans", HERE / "remote_drivers.py"))
    one.start()
    assert (one.traits.wants, one.traits.period) == (("lanes", "map", "conflicts", "history"), 0.2)


def test_a_driver_is_given_what_a_class_is_given(driver):
    given, seen = with_all()
    one = driver(command("Reports", HERE / "remote_drivers.py"))
    one.reset(N, given)
    message = r"\('bv',\) int64 1:0:-1 None \(3, 4\) \[2.0, 0.0\] int8 \[True, True\]"
    with pytest.raises(DriverError, match=message):
        one.act(seen)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("connect:127.0.0.1:{port}", "127.0.0.1"),
        ("connect:no-such-host.invalid:80", "80"),
        ("unix:no/such/socket", "reached"),
        ("exec:no-such-program --fast", "no-such-program"),
        ("exec:true", "process"),
        (
            "exec:echo hello",
            "",
        ),
        (command("CannotBeMade"), "drivers.py"),
        (command("Cruises", "no_such.py"), "FileNotFoundError"),
    ],
)
def test_what_does_not_start_is_an_error_of_the_users(driver, spec, message):
    with refuses(InputError, message):
        driver(spec.format(port=free_port())).start()


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("connect:localhost", "connect:HOST:PORT"),
        ("connect::5555", "connect:HOST:PORT"),
        ("connect:::1:5555", "address"),
        ("connect:localhost:0", "65535"),
        ("connect:localhost:65536", "65535"),
        ("connect:localhost:٣", "65535"),
        ("unix:", "103"),
        ("unix:" + "é" * 60, "120"),
        ("exec:", "followed"),
        ("exec:''", "followed"),
        ("exec:echo 'a", "exec:"),
    ],
)
def test_what_is_no_address(spec, message):
    with refuses(InputError, message):
        get(spec)


def test_a_server_that_was_there_is_waited_for(server, driver, monkeypatch):
    monkeypatch.setattr(remote_process, "AGAIN_SECONDS", 0.5)
    found = server(HELLO, READY, None)
    one = driver(found.spec)
    one.reset(N, scene())
    with refuses(DriverError):
        one.act(observation())
    found.close()
    start = time.monotonic()
    with pytest.raises(InputError, match="nobody listens"):
        one.reset(N, scene())
    assert time.monotonic() - start > 0.4
    other = server(HELLO, READY, CONTROL, address=found.address)
    one.reset(N, scene())
    assert one.act(observation())[0].tolist() == [1.0] * N
    assert len(other.connections) == 1


def test_a_server_that_is_killed_ends_the_connection(served, driver):
    process, spec = served(f"{DRIVERS}:Hangs")
    one = driver(spec)
    one.reset(N, scene())
    os.kill(process.pid, signal.SIGKILL)
    with refuses(DriverError) as error:
        one.act(observation())
    assert error.value.kind == "died"


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_no_process_of_a_program_is_left(driver, tmp_path):
    script = tmp_path / "wraps.sh"
    script.write_text(f"sleep 300 & echo $! > {tmp_path}/pid; exec {SERVE} {DRIVERS}:Cruises\n")
    one = driver(f"exec:sh {script}")
    one.reset(N, scene())
    number = (tmp_path / "pid").read_text().strip()
    assert Path(f"/proc/{number}").exists()
    one.close()
    stat = Path(f"/proc/{number}/stat")
    assert not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"


def test_a_trajectory_comes_as_one(server, driver, monkeypatch):
    found = []
    monkeypatch.setattr(
        "bridgegen.drivers.driver_process.checked",
        lambda answer, *_: found.append(answer) or answer,
    )
    one = driver(server(HELLO, READY, pack({"type": "trajectory", **TRAJECTORY})).spec)
    one.reset(N, scene())
    one.act(observation())
    assert [getattr(found[0], name).tolist() for name in TRAJECTORY] == [
        part.tolist() for part in TRAJECTORY.values()
    ]


def test_a_file_in_the_place_of_a_unix_socket_is_kept(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("mine")
    with refuses(OSError):
        serve(object, f"unix:{path}")
    assert path.read_text() == "mine"


def test_a_network_that_is_down_closes_the_connection(monkeypatch):
    server = Server(HELLO, READY)
    wire = connected(address_of(server.spec))

    def read(*_):
        raise OSError(errno.EHOSTUNREACH, "No route to host")

    monkeypatch.setattr(os, "read", read)
    with refuses(ClosedError):
        wire.ask(HELLO, 5.0)
    monkeypatch.undo()
    wire.close()
    server.close()
