"""A page of this machine for this machine: HTTP on loopback, and nothing that a stranger could use.

Any website that is open in the same browser can send requests to a server on loopback. So requests
are answered only under the names of loopback in the ``Host`` header (a website whose name is made
to point here sends its own), and the answers tell the browser not to let other pages read or frame
them. Any other user of this machine can send requests, too: so every address begins with a secret
token. A site that is edited takes small JSON by POST, from its own pages only; other sites take
nothing. A page that lies on the disk, which may be a stranger's, has no origin here: its scripts
can neither read what is served nor write.

One request is answered at a time. One whose browser has hung up meanwhile is dropped.
"""

import hmac
import json
import secrets
import select
import socket
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Protocol, runtime_checkable
from urllib.parse import parse_qs, unquote, urlsplit

from bridgegen.base.errors import BridgeGenError, InputError

# Any website open in the same browser can send requests here, and so can other users of the
# machine: the rules below are for these two.
LOOPBACK = "127.0.0.1"
MAX_PORT = 65_535

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}

# A page from the disk may be a stranger's. Without an origin its scripts are cross-site here; a
# sandboxed page may have no opener policy either, or browsers refuse it.
OF_DISK: Mapping[str, str] = {
    "Content-Security-Policy": "sandbox allow-scripts allow-downloads; "
    + POLICY.replace("connect-src 'self'", "connect-src 'none'").replace("'self'", "'none'"),
    "Cross-Origin-Opener-Policy": "unsafe-none",
}

MAX_BODY = 16_384
"""Maximum length of what a page may send [bytes]."""

MOST_ASKED = 40
"""Maximum number of growing runs that are asked about at a time."""

TYPES = {
    "html": "text/html; charset=utf-8",
    "json": "application/json",
    "owl": "application/rdf+xml",
    "xml": "application/xml",
}


class Site(Protocol):
    """What is served."""

    def page(self) -> bytes:
        """Return the page, as HTML."""

    def news(self, after: int) -> Mapping[str, Any]:
        """Return what is new since the page knew of so many evaluations."""

    def motion(self, evaluation: int) -> Mapping[str, Any] | None:
        """Return the motion of an evaluation, from 0; None if there is no such row."""

    def file(self, name: str) -> bytes | None:
        """Return an exported file by its path in the run's folder; None if there is none."""

    def finding(self, name: str) -> bytes | None:
        """Return the page of one exported scenario, to be sent; None if there is none."""


@runtime_checkable
class Sites(Protocol):
    """Several sites, and a page that leads to them."""

    def page(self) -> bytes:
        """Return the page that leads to all, as HTML."""

    def run(self, number: int) -> Site | None:
        """Return a site; None if there is none of that number."""

    def pair(self, first: int, second: int) -> bytes | None:
        """Return a page of two of them, as HTML; None if one does not exist."""


@dataclass(frozen=True)
class Answer:
    """What a request is answered with."""

    status: HTTPStatus
    kind: str
    body: bytes
    headers: Mapping[str, str] = field(default_factory=dict)


@runtime_checkable
class Project(Sites, Protocol):
    """Several sites, the files of a project, and what a person decides about its failures."""

    def news(self, after: Sequence[int]) -> Mapping[str, Any]:
        """Return how many runs there are, and how far some are, by their numbers."""

    def place(self, path: str) -> Answer | None:
        """Return what is at a path of the project's folder; None if nothing is served there."""

    def decide(self, asked: Mapping[str, Any]) -> tuple[HTTPStatus, Mapping[str, Any]]:
        """Write what a page asks for; return the status and what the page is told."""


def answer(site: Site | Sites, target: str) -> Answer:
    """Return the answer to a GET request for a path with its query.

    An error is the answer, in the words of the command line.
    """
    try:
        return _answer(site, target)
    except BridgeGenError as error:
        return _json({"error": list(error.problems)}, HTTPStatus.INTERNAL_SERVER_ERROR)


def _answer(site: Site | Sites, target: str) -> Answer:
    try:
        split = urlsplit(target)
        path = unquote(split.path, errors="strict")
        query = parse_qs(split.query, max_num_fields=4)
    except ValueError:
        return _nothing()
    if isinstance(site, Sites):
        return _of_sites(site, path, query)
    return _of_site(site, path, query)


def _of_sites(sites: Sites, path: str, query: Mapping[str, list[str]]) -> Answer:
    if path == "/":
        return Answer(HTTPStatus.OK, TYPES["html"], sites.page())
    if path == "/pair":
        first, second = (_number(query.get(name, [""])[0]) for name in ("first", "second"))
        page = None if first is None or second is None else sites.pair(first, second)
        return _nothing() if page is None else Answer(HTTPStatus.OK, TYPES["html"], page)
    kind, _, rest = path.removeprefix("/").partition("/")
    if isinstance(sites, Project) and path == "/news":
        numbers = [_number(text) for text in query.get("run", [""])[0].split(",")[:MOST_ASKED]]
        return _json(sites.news([number for number in numbers if number is not None]))
    if isinstance(sites, Project) and kind == "p":
        return sites.place(rest) or _nothing()
    name, slash, rest = rest.partition("/")
    number = _number(name) if kind == "run" and slash else None
    try:
        site = None if number is None else sites.run(number)
    except BridgeGenError as error:  # a person reads it
        text = "\n".join(error.problems).encode()
        return Answer(HTTPStatus.INTERNAL_SERVER_ERROR, "text/plain; charset=utf-8", text)
    return _nothing() if site is None else _of_site(site, f"/{rest}", query)


def _of_site(site: Site, path: str, query: Mapping[str, list[str]]) -> Answer:
    if path == "/":
        return Answer(HTTPStatus.OK, TYPES["html"], site.page())
    if path == "/news":
        after = _number(query.get("after", ["0"])[0])
        return _nothing() if after is None else _json(site.news(after))
    if path.startswith("/motion/"):
        evaluation = _number(path.removeprefix("/motion/"))
        motion = None if evaluation is None else site.motion(evaluation)
        return _nothing() if motion is None else _json(motion)
    if path.startswith("/send/"):
        page = site.finding(path.removeprefix("/send/").removesuffix(".html"))
        return _nothing() if page is None else Answer(HTTPStatus.OK, TYPES["html"], page, OF_DISK)
    # A site answers from a list of exported files, never by a path: neither `..` nor a link leads
    # out of the run.
    body = site.file(path.removeprefix("/"))
    if body is None:
        return _nothing()
    kind = TYPES.get(path.rpartition(".")[2], TYPES["xml"])
    return Answer(HTTPStatus.OK, kind, body)


def _number(text: str) -> int | None:
    """Return a number of evaluations; None of anything else."""
    # `int` takes signs, spaces, underscores and digits of all scripts.
    return int(text) if text.isascii() and text.isdigit() and len(text) < 12 else None


def _json(value: Mapping[str, Any], status: HTTPStatus = HTTPStatus.OK) -> Answer:
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Answer(status, TYPES["json"], text.encode())


def _nothing() -> Answer:
    return Answer(HTTPStatus.NOT_FOUND, "text/plain", b"There is nothing here.\n")


class _Handler(BaseHTTPRequestHandler):
    server: "Server"
    server_version, sys_version = "BridgeGen", ""
    protocol_version = "HTTP/1.1"
    timeout = 30.0  # of a connection on which nothing comes

    def do_GET(self) -> None:
        self._send(self._found())

    def do_HEAD(self) -> None:
        self._send(self._found(), body=False)

    def do_POST(self) -> None:
        self.close_connection = True  # what is refused is not read: no further request follows it
        self._send(self._written())

    def _refused(self) -> Answer | None:
        """Return what a stranger is answered; None to those that may ask."""
        # Against DNS rebinding: a name of a stranger's that resolves to this machine.
        if self.headers.get_all("Host", []) not in ([name] for name in self.server.names):
            text = b"This server is for the machine that it runs on.\n"
            return Answer(HTTPStatus.MISDIRECTED_REQUEST, "text/plain", text)
        # Websites may not even make work for it: what they send, the browser marks. It also marks
        # the way here from the page on disk that it is started with; that one opens a document.
        elsewhere = self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin")
        if elsewhere and self.headers.get("Sec-Fetch-Dest") != "document":
            return Answer(HTTPStatus.FORBIDDEN, "text/plain", b"Not for other websites.\n")
        token, slash, _ = self.path.removeprefix("/").partition("/")
        # The token keeps out other users of the machine; compared in constant time.
        if not (slash and hmac.compare_digest(token.encode(), self.server.token.encode())):
            text = b"The address must be the one that 'bridgegen open' printed, with its token.\n"
            return Answer(HTTPStatus.FORBIDDEN, "text/plain", text)
        return None

    def _found(self) -> Answer | None:
        """Return the answer; None if the browser has hung up."""
        if refused := self._refused():
            return refused
        rest = self.path.removeprefix("/").partition("/")[2]
        with self.server.turn:
            return None if self._is_gone() else answer(self.server.site, f"/{rest}")

    def _written(self) -> Answer:
        """Return the answer to what a page of ours sends; nothing of another's is read."""
        if refused := self._refused():
            return refused
        site, to = self.server.site, self.path.removeprefix("/").partition("/")[2]
        if not isinstance(site, Project) or to != "status":
            return Answer(HTTPStatus.NOT_IMPLEMENTED, "text/plain", b"Nothing is written here.\n")
        # Browsers state the origin of every POST; that of a sandboxed page is "null".
        if self.headers.get_all("Origin", []) != [f"http://{self.headers['Host']}"]:
            return Answer(HTTPStatus.FORBIDDEN, "text/plain", b"Not for other websites.\n")
        if self.headers.get_content_type() != "application/json":
            # A form of another website cannot send this type without being asked.
            return _json({"error": ["only JSON is taken"]}, HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        length = _number(self.headers.get("Content-Length", ""))
        if length is None or "Transfer-Encoding" in self.headers:
            return _json({"error": ["a length must be stated"]}, HTTPStatus.LENGTH_REQUIRED)
        if length > MAX_BODY:
            text = f"at most {MAX_BODY:,} bytes are taken, got {length:,}"
            return _json({"error": [text]}, HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        try:
            asked = json.loads(self.rfile.read(length))
        except (ValueError, RecursionError):
            asked = None
        if not isinstance(asked, dict):
            return _json({"error": ["what was sent is no JSON object"]}, HTTPStatus.BAD_REQUEST)
        try:
            with self.server.turn:
                status, told = site.decide(asked)
        except BridgeGenError as error:
            return _json({"error": list(error.problems)}, HTTPStatus.INTERNAL_SERVER_ERROR)
        return _json(told, status)

    def _is_gone(self) -> bool:
        """Whether the browser has hung up while others were answered."""
        readable, _, _ = select.select([self.connection], [], [], 0.0)
        try:
            return bool(readable) and not self.connection.recv(1, socket.MSG_PEEK)
        except OSError:
            return True

    def _send(self, item: Answer | None, *, body: bool = True) -> None:
        if item is None:
            self.close_connection = True
            return
        self.send_response(item.status)
        for name, value in {**HEADERS, "Content-Type": item.kind, **item.headers}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(item.body)))
        self.end_headers()
        if body:
            self.wfile.write(item.body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: the terminal is the user's."""


class Server(ThreadingHTTPServer):
    """A server on loopback, listening from the start; `serve_forever` answers.

    Args:
        site: what to serve.
        port: 0 for one that is free.

    Attributes:
        token: a secret of this server; every address begins with it.
        url: of the page, with the token.
        turn: held while a request is answered.

    Raises:
        InputError: no such port, or it is not available.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, site: Site | Sites, port: int = 0) -> None:
        self.site, self.token, self.turn = site, secrets.token_urlsafe(24), threading.Lock()
        if not 0 <= port <= MAX_PORT:
            raise InputError(f"0 <= port <= {MAX_PORT} must hold, got {port}")
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as error:
            raise InputError(
                f"port {port} of {LOOPBACK} is not available: {error.strerror}; "
                "choose another with --port, or leave it out"
            ) from None
        port = self.server_address[1]
        self.url = f"http://{LOOPBACK}:{port}/{self.token}/"
        self.names = frozenset(f"{name}:{port}" for name in (LOOPBACK, "localhost"))
        if port == 80:
            self.names |= {LOOPBACK, "localhost"}

    def handle_error(self, request: object, client_address: object) -> None:
        """Let a browser go that has hung up; anything else is a mistake of ours, and is shown."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]

    def start(self) -> threading.Thread:
        """Serve in a thread of its own, until ``shutdown``."""
        thread = threading.Thread(target=self.serve_forever, name="view", daemon=True)
        thread.start()
        return thread
