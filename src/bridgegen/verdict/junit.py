"""Results as JUnit XML, which Jenkins, GitLab and their like show as tests.

Elements and attributes are those of Jenkins' schema (xunit-plugin, junit-10.xsd), which knows
properties of a suite, and none of a case: so a scenario with its metrics is a suite of its own.
"""

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lxml import etree

from bridgegen.disk import write_whole
from bridgegen.errors import StorageError
from bridgegen.verdict.criteria import Outcome

Problem = Literal["failure", "error"]

_ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PROBLEMS: Mapping[str, Problem | None] = {
    "passed": None,
    "failed": "failure",
    "unknown": "error",
}
_HEAD = 1000
"""Bytes of a file within which JUnit XML says what it is."""


@dataclass(frozen=True)
class Case:
    """One test.

    Attributes:
        group: of tests, dots apart; Jenkins shows it as package and class.
        name: the same from run to run.
        problem: "failure", "error" (it could not be told), or None if it passed.
        message: what it came to, in one line.
        text: whatever else helps.
    """

    group: str
    name: str
    problem: Problem | None = None
    message: str = ""
    text: str = ""


@dataclass(frozen=True)
class Suite:
    """Tests that share properties.

    Attributes:
        name: of the suite.
        cases: its tests.
        properties: facts by name, in their order.
        seconds: that it took [s], if that is known.
    """

    name: str
    cases: Sequence[Case]
    properties: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None


def case_of(group: str, outcome: Outcome) -> Case:
    """Return an outcome as a test."""
    kind = _PROBLEMS[outcome.verdict]
    return Case(group, outcome.test, kind, outcome.said)


def junit_xml(suites: Iterable[Suite]) -> bytes:
    """Return suites as a JUnit XML document; characters that XML cannot hold become U+FFFD."""
    root = etree.Element("testsuites", name="bridgegen")
    total = dict.fromkeys(("tests", "failures", "errors"), 0)
    for suite in suites:
        counts = {
            "tests": len(suite.cases),
            "failures": sum(one.problem == "failure" for one in suite.cases),
            "errors": sum(one.problem == "error" for one in suite.cases),
        }
        total = {name: total[name] + count for name, count in counts.items()}
        element = etree.SubElement(root, "testsuite", name=_legal(suite.name), skipped="0")
        for name, count in counts.items():
            element.set(name, str(count))
        if suite.seconds is not None:
            element.set("time", f"{suite.seconds:.3f}")
        if suite.properties:
            listed = etree.SubElement(element, "properties")
            for name, value in suite.properties.items():
                etree.SubElement(listed, "property", name=_legal(name), value=_legal(value))
        for case in suite.cases:
            element.append(_case(case))
    for name, count in total.items():
        root.set(name, str(count))
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _case(case: Case) -> etree._Element:
    element = etree.Element("testcase", classname=_legal(case.group), name=_legal(case.name))
    text = _legal("\n".join(filter(None, (case.message, case.text))))
    if case.problem:
        etree.SubElement(element, case.problem, message=_legal(case.message)).text = text
    else:
        etree.SubElement(element, "system-out").text = text
    return element


def _legal(text: str) -> str:
    return _ILLEGAL.sub("\ufffd", text)


def refuse_junit(path: Path) -> None:
    """Refuse a place where no JUnit XML can be written, or where something else is.

    Raises:
        StorageError: no folder can be made there, or a file is there that is no JUnit XML.
    """
    folder = next(one for one in path.absolute().parents if one.exists())
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise StorageError(f"{path}: cannot be written: {folder} is no folder that can be written")
    try:
        with path.open("rb") as file:
            ours = b"<testsuite" in file.read(_HEAD)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{path}: exists already, is no JUnit XML, and is not overwritten")


def write_junit(path: Path, suites: Iterable[Suite]) -> None:
    """Write suites as JUnit XML, into a new folder if need be; an earlier one is replaced.

    Raises:
        StorageError: see ``refuse_junit``; or the disk is full.
    """
    refuse_junit(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    write_whole(path, [junit_xml(suites)])
