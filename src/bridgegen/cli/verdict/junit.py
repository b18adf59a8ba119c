"""Results as JUnit XML, which Jenkins, GitLab and other CI systems show as tests.

Elements and attributes follow Jenkins' schema (xunit-plugin, junit-10.xsd), in which suites have
properties and cases have not: so each scenario with its metrics is a suite.
"""

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lxml import etree

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.cli.verdict.fail_if import Outcome

Problem = Literal["failure", "error", "skipped"]

# XML 1.0 has no other characters, not even escaped; names come from files of others.
_ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PROBLEMS: Mapping[str, Problem | None] = {
    "passed": None,
    "failed": "failure",
    "unknown": "error",
}
_HEAD = 1000
"""Length of a file's beginning within which JUnit XML has its first element [bytes]."""


@dataclass(frozen=True)
class Case:
    """One test.

    Attributes:
        group: of tests, separated by dots; Jenkins shows it as package and class.
        name: the same in each run.
        problem: "failure", "error" (it could not be judged), "skipped" (its failure is known), or
            None if it passed.
        message: the result in one line.
        text: further details.
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
        properties: values by name, in order.
        seconds: duration [s], if known.
    """

    name: str
    cases: Sequence[Case]
    properties: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None


def case_of(group: str, outcome: Outcome) -> Case:
    """Return an outcome as a test."""
    kind = _PROBLEMS[outcome.verdict]
    return Case(group, outcome.test, kind, outcome.details)


def junit_xml(suites: Iterable[Suite]) -> bytes:
    """Return suites as a JUnit XML document; characters that XML cannot hold become U+FFFD."""
    root = etree.Element("testsuites", name="bridgegen")
    total = dict.fromkeys(("tests", "failures", "errors"), 0)
    for suite in suites:
        counts = {
            "tests": len(suite.cases),
            "failures": sum(item.problem == "failure" for item in suite.cases),
            "errors": sum(item.problem == "error" for item in suite.cases),
        }
        total = {name: total[name] + count for name, count in counts.items()}
        skipped = sum(item.problem == "skipped" for item in suite.cases)
        element = etree.SubElement(root, "testsuite", name=_legal(suite.name), skipped=f"{skipped}")
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
    """Reject a path that is not `writable` as JUnit XML."""
    writable(path, "<testsuite", "JUnit XML")


def writable(path: Path, mark: str, what: str) -> None:
    """Reject a path that is not writable, or at which another kind of file exists.

    Args:
        path: of the file.
        mark: text that is in the beginning of each file of that kind.
        what: the kind.

    Raises:
        StorageError: its folder cannot be created, or a file exists that is of another kind.
    """
    # Asked before the run, too, which may take hours: the folder is made only after it.
    folder = next(parent for parent in path.absolute().parents if parent.exists())
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise StorageError(f"{path}: cannot be written: {folder} is not a writable folder")
    try:
        with path.open("rb") as file:
            ours = mark.encode() in file.read(_HEAD)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{path}: exists already, is not {what}, and is not overwritten")


def write_junit(path: Path, suites: Iterable[Suite]) -> None:
    """Write suites as JUnit XML; create its folder if needed, replace an earlier JUnit XML.

    Raises:
        StorageError: see ``refuse_junit``; or the disk is full.
    """
    refuse_junit(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    write_whole(path, [junit_xml(suites)])
