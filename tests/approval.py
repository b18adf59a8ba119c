"""Messages of the product, which stand approved in one file, ``messages.txt``.

A test says what a message is about; the file has the sentence, under the test's id. Every test
compares its own messages as it meets them, in their order. ``pytest --approve-messages FILES``
writes those of the tests that ran and passed; the file's diff is what a reviewer approves.
"""

import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from linecache import getline
from pathlib import Path
from traceback import walk_tb
from typing import Any

import pytest

import bridgegen

TABLE = Path(__file__).with_name("messages.txt")
ROOT = Path(__file__).parents[1]
OURS = (Path(bridgegen.__file__).parent, Path(__file__).parent)
"""The package lies beside the tests only where it is installed to be edited."""

HEAD = "# Approved by: pytest --approve-messages; see tests/approval.py\n"


class _Now:
    """The test that runs, and the number of messages that it has met."""

    item: Any = None
    met = 0


@contextmanager
def refuses(
    error: type[BaseException] | tuple[type[BaseException], ...], *named: object
) -> Iterator[Any]:
    """Expect an error whose message is the approved one, and names what the rule is about."""
    with pytest.raises(error) as caught:
        yield caught
    _compare(f"{type(caught.value).__name__}: {_without_foreign_words(caught.value)}", named)


def approve(text: str | Iterable[str], *named: object) -> None:
    """Expect that a text, or some, is the approved one, and names each thing.

    Of several lines those count that name one of them; without names, all.
    """
    whole = text if isinstance(text, str) else "\n".join(text)
    # A number is looked for in what is the same everywhere: a temporary folder has numbers, too.
    lines = [
        line
        for line in whole.splitlines()
        if not named
        or any(
            name in (_same_everywhere(line, _Now.item.config) if name.isdigit() else line)
            for name in map(str, named)
        )
    ]
    _compare("\n".join(lines), named)


def _compare(text: str, named: tuple[object, ...]) -> None:
    __tracebackhide__ = True
    absent = [str(one) for one in named if str(one) not in text]
    assert not absent, f"{absent} should be named in: {text}"
    item, met = _Now.item, _Now.met
    _Now.met += 1
    message = _same_everywhere(text, item.config)
    if item.config.getoption("approve_messages"):
        item.user_properties.append(("message", message))
        return
    known = approved().get(_id(item.nodeid), [])
    if met >= len(known):
        pytest.fail(f"a message that is not approved yet: {message}\n{_command(item)}")
    if message != known[met]:
        pytest.fail(f"approved: {known[met]}\nis now:   {message}\n{_command(item)}")


def _command(item: Any) -> str:
    return f"If it is meant: pytest --approve-messages {item.location[0]}"


def _id(test: str) -> str:
    """Return a test's id as it is on every machine: a parameter may be a path."""
    return test.replace(sys.executable, "<python>").replace(str(ROOT), "<repository>")


def _same_everywhere(text: str, config: Any) -> str:
    """Replace what differs by machine, run and version, and layout."""
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text).replace(sys.executable, "<python>")
    base = re.escape(str(config._tmp_path_factory.getbasetemp()))
    text = re.sub(base + r"(/[\w.-]+)?", "<tmp>", text).replace(str(ROOT), "<repository>")
    text = re.sub(r"(\.py(?::|, line |\", line ))\d+", r"\1<line>", text)
    text = re.sub(r"\b(?:Input|String|List) should [\w ]+(?:, unable [\w ]+)?", "<pydantic>", text)
    text = re.sub(r"(127\.0\.0\.1:|localhost:|\bport )\d{4,5}\b", r"\1<port>", text)
    text = re.sub(r"\b[0-9a-f]{64}\b", "<sha256>", text)
    text = re.sub(r"\(\d+ s\)", "(<duration>)", text)
    text = re.sub(r"\b[\d,]+ scenarios/s\b", "<rate> scenarios/s", text)
    text = re.sub(r"\bstopped after [\d,]+ of\b", "stopped after <some> of", text)
    text = re.sub(r"\b(BridgeGen \(?)\d+\.\d+\.\d+", r"\1<version>", text)
    text = re.sub(r"<frozen [\w.]+>:\d+", "<frozen>", text)
    text = re.sub(r"(; known: (?:[^,\n]+, ){3})(?:[^,\n]+, ){5}[^\n]*", r"\1…", text)
    return "\n".join(" ".join(line.split()) for line in text.splitlines() if line.strip())


def _without_foreign_words(error: BaseException) -> str:
    """Return an error's text, with what it quotes of Python and of libraries as the kind of it."""
    text, cause = str(error), error.__cause__ or error.__context__
    while cause is not None:
        if _is_foreign(cause):
            quoted = (str(cause), *map(str, cause.args), getattr(cause, "msg", None))
            for words in sorted({str(one) for one in quoted if one}, key=len, reverse=True):
                if " " in words:
                    text = text.replace(words, f"<{type(cause).__name__}>")
        cause = cause.__cause__ or cause.__context__
    return text


def _is_foreign(error: BaseException) -> bool:
    """Say whether Python or a library wrote an error's text, which differs by its version.

    It did, unless the last line that the error comes from is a ``raise`` of ours.
    """
    for frame, number in reversed(list(walk_tb(error.__traceback__))):
        file = Path(frame.f_code.co_filename)
        ours = any(file.is_relative_to(folder) for folder in OURS)
        return not (ours and getline(str(file), number).lstrip().startswith("raise "))
    return False


@cache
def approved() -> dict[str, list[str]]:
    """Return the approved messages by the id of the test that meets them."""
    found: dict[str, list[str]] = {}
    known: list[str] = []
    for line in TABLE.read_text("utf-8").split("\n") if TABLE.exists() else ():
        if line.startswith("      "):
            known[-1] += "\n" + line[6:]
        elif line.startswith("    "):
            known.append(line[4:])
        elif line and not line.startswith("#"):
            known = found.setdefault(line, [])
    return found


def _write(table: dict[str, list[str]]) -> None:
    lines = [HEAD]
    for test in sorted(table):
        lines += [test, *("    " + message.replace("\n", "\n      ") for message in table[test])]
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def is_there(test: str) -> bool:
    """Say whether a test's file still has a function of its name."""
    file, *_, function = test.partition("[")[0].split("::")
    path = ROOT / file
    return path.exists() and f"def {function}(" in path.read_text("utf-8")


class Approval:
    """The plugin of pytest: follows which test runs, and writes the file where it is asked to."""

    def __init__(self) -> None:
        self._ran: dict[str, list[str]] = {}
        self._seen: set[str] = set()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: Any) -> None:
        _Now.item, _Now.met = item, 0

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: Any) -> Any:
        result = yield
        known = approved().get(_id(item.nodeid), [])
        if _Now.met < len(known) and not item.config.getoption("approve_messages"):
            pytest.fail(f"approved, and not met: {known[_Now.met]}\n{_command(item)}")
        return result

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._seen.add(_id(report.nodeid))
        if report.when == "call" and report.passed:
            self._ran[_id(report.nodeid)] = [
                m for name, m in report.user_properties if name == "message"
            ]

    def pytest_sessionfinish(self, session: Any) -> None:
        config = session.config
        if not config.getoption("approve_messages") or hasattr(config, "workerinput"):
            return
        table = {test: known for test, known in approved().items() if is_there(test)}
        if not config.option.keyword and not any("[" in one for one in config.args):
            ran = {test.partition("[")[0] for test in self._ran}
            for test in [t for t in table if t.partition("[")[0] in ran and t not in self._seen]:
                del table[test]  # a parameter that is gone
        table.update(self._ran)
        _write({test: known for test, known in table.items() if known})
