"""The server gives what it has to this machine's browser, and nothing to anybody else."""

import http.client
import json
import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.view.server import LOOPBACK, Server, answer


class Site:
    """One page, two evaluations, one file; and whoever asks for evaluation 9 finds a broken run."""

    def page(self) -> bytes:
        return "<p>the page ≤</p>".encode()

    def news(self, after: int) -> dict[str, Any]:
        return {"after": after}

    def motion(self, evaluation: int) -> dict[str, Any] | None:
        if evaluation == 9:
            raise StorageError("run: the file is damaged")
        return {"playback": evaluation} if evaluation < 2 else None

    def file(self, name: str) -> bytes | None:
        return b"<xml/>" if name == "critical/0001.xosc" else None

    def finding(self, name: str) -> bytes | None:
        return b"<p>one crash</p>" if name == "0001" else None


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server(Site())
    server.start()
    yield server
    server.shutdown()
    server.server_close()


def ask(
    server: Server, path: str, method: str = "GET", token: str | None = None, **headers: str
) -> tuple[int, dict[str, str], bytes]:
    """Ask for a path behind the server's token, or behind another one."""
    port = server.server_address[1]
    path = f"/{server.token if token is None else token}{path}"
    connection = http.client.HTTPConnection(LOOPBACK, port, timeout=10)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    reply = connection.getresponse()
    found = reply.status, {k.lower(): v for k, v in reply.getheaders()}, reply.read()
    connection.close()
    return found


def test_it_gives_the_page_what_is_new_motion_and_files(server):
    assert ask(server, "/")[2].decode() == "<p>the page ≤</p>"
    assert json.loads(ask(server, "/news?after=17")[2]) == {"after": 17}
    assert json.loads(ask(server, "/news")[2]) == {"after": 0}
    assert json.loads(ask(server, "/motion/1")[2]) == {"playback": 1}
    status, headers, body = ask(server, "/critical/0001.xosc")
    assert (status, body, headers["content-type"]) == (200, b"<xml/>", "application/xml")


def test_it_listens_on_loopback_only(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_address[1]}/{server.token}/"


@pytest.mark.parametrize("path", ["/", "/news", "/motion/1", "/critical/0001.xosc", "//", ""])
def test_without_the_token_it_says_nothing(server, path):
    """Any user of this machine can reach the port."""
    for token in ("", "x" * len(server.token), server.token[:-1], server.token + "x", "%ff"):
        status, _, body = ask(server, path, token=token)
        assert (status, b"page" in body, b"xml" in body) == (403, False, False)


def test_each_server_has_a_token_of_its_own():
    tokens = set()
    for _ in range(3):
        server = Server(Site())
        tokens.add(server.token)
        server.server_close()
    assert len(tokens) == 3
    assert all(len(token) >= 32 for token in tokens)


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:{port}", "", "*"]
)
def test_under_any_other_name_it_says_nothing(server, host):
    port = server.server_address[1]
    status, _, body = ask(server, "/", Host=host.format(port=port))
    assert status == 421
    assert b"page" not in body


def test_both_names_of_loopback_will_do(server):
    port = server.server_address[1]
    assert ask(server, "/", Host=f"localhost:{port}")[0] == 200
    assert ask(server, "/", Host=f"127.0.0.1:{port}")[0] == 200


def test_two_names_are_none(server):
    port = server.server_address[1]
    with socket.create_connection((LOOPBACK, port), timeout=10) as stream:
        name = f"127.0.0.1:{port}"
        hosts = f"Host: {name}\r\nHost: evil.example\r\n"
        text = f"GET /{server.token}/ HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n"
        stream.sendall(text.encode())
        assert stream.makefile("rb").readline().split()[1] == b"421"


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_other_websites_are_sent_away(server, site):
    assert ask(server, "/motion/1", Sec_Fetch_Site=site)[0] == 403
    assert ask(server, "/motion/1", Sec_Fetch_Site=site, Sec_Fetch_Dest="script")[0] == 403
    assert ask(server, "/motion/1", Sec_Fetch_Site="same-origin")[0] == 200
    # From the page on disk that the browser is started with.
    assert ask(server, "/", Sec_Fetch_Site=site, Sec_Fetch_Dest="document")[0] == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "CONNECT", "get"])
def test_nothing_but_get_is_answered(server, method):
    status, _, body = ask(server, "/", method)
    assert status == 501
    assert b"the page" not in body


def test_head_has_the_length_and_no_body(server):
    status, headers, body = ask(server, "/", "HEAD")
    assert (status, headers["content-length"], body) == (200, "19", b"")


@pytest.mark.parametrize(
    "path",
    [
        "/critical/../run.sqlite", "/critical/%2e%2e/run.sqlite", "/../../etc/passwd",
        "//etc/passwd", "/run.sqlite", "/critical", "/critical/", "/motion/2", "/motion/-1",
        "/motion/1e3", "/motion/", "/motion/٣", "/news?after=-1", "/news?after=x", "/%ff",
        "/critical/0001.xosc%00", "/motion/" + "9" * 40, "/critical\\0001.xosc",
    ],
)  # fmt: skip
def test_what_is_not_there_is_not_found(path):
    assert answer(Site(), path).status == 404


@given(st.text())
def test_no_path_at_all_breaks_it(path):
    assert answer(Site(), path).status in (200, 404, 500)


def test_what_goes_wrong_is_told(server):
    status, _, body = ask(server, "/motion/9")
    assert (status, json.loads(body)) == (500, {"error": ["run: the file is damaged"]})


def test_every_answer_tells_the_browser_to_keep_it_to_itself(server):
    for path in ("/", "/news", "/nowhere"):
        headers = ask(server, path)[1]
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "connect-src 'self'" in policy
        assert "frame-ancestors 'self'" in policy
        assert "'unsafe-eval'" not in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["cache-control"] == "no-store"
        assert "access-control-allow-origin" not in headers


def test_a_port_that_is_taken_or_none_is_one_clear_error(server):
    port = server.server_address[1]
    with refuses(InputError, port, "127.0", "--port"):
        Server(Site(), port)
    for none in (-1, 65_536):
        with refuses(InputError, "65535", none):
            Server(Site(), none)


class Slow(Site):
    """Takes as long for the first page as the test likes, and counts the motions."""

    def __init__(self) -> None:
        self.begun, self.go_on, self.moved = threading.Event(), threading.Event(), []

    def page(self) -> bytes:
        self.begun.set()
        assert self.go_on.wait(30.0)
        return b""

    def motion(self, evaluation: int) -> dict[str, Any] | None:
        self.moved.append(evaluation)
        return {}


def test_what_nobody_waits_for_any_more_is_not_worked_out():
    """Who clicks through twenty scenarios wants the last one, not all twenty one by one."""
    site = Slow()
    server = Server(site)
    server.start()
    name = f"127.0.0.1:{server.server_address[1]}"
    page = threading.Thread(target=ask, args=(server, "/"))
    page.start()
    assert site.begun.wait(30.0)
    for evaluation in range(20):
        with socket.create_connection(server.server_address, timeout=10) as stream:
            target = f"/{server.token}/motion/{evaluation}"
            stream.sendall(f"GET {target} HTTP/1.1\r\nHost: {name}\r\n\r\n".encode())
    last = threading.Thread(target=ask, args=(server, "/motion/99"))
    last.start()
    site.go_on.set()
    page.join(30.0)
    last.join(30.0)
    server.shutdown()
    server.server_close()
    assert site.moved == [99]


def test_a_browser_that_hangs_up_is_no_trouble(server, capfd):
    for _ in range(3):
        with socket.create_connection((LOOPBACK, server.server_address[1]), timeout=10) as stream:
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            stream.sendall(b"GET / HTTP/1.1\r\n")
    assert ask(server, "/")[0] == 200
    assert capfd.readouterr().err == ""
