"""The validation suite: what the installed package answers to cases whose answer is known.

`validate` runs it, offline and with nothing but the package. Its protocol is ``validation.json``.
"""

import hashlib
import json
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from math import isfinite, nan
from pathlib import Path
from typing import Any

from bridgegen.base._elementary_kernels import FUNCTIONS
from bridgegen.engine import conformance
from bridgegen.jobs.credibility.known_answers import HERE, Case, Check, cases, data
from bridgegen.jobs.frame import JobCallbacks, Judged, Table
from bridgegen.pages.templates import counted

FILE = "validation.json"

FIGURES = {"cases": ("answer", "law", "bits"), "wrong": ("answer", "law"), "other_bits": ("bits",)}
"""Figures of the suite: how many cases there are; and how many of some kinds fail."""


@dataclass(frozen=True)
class Protocol:
    """The protocol of the suite.

    Attributes:
        facts: as JSON's types: "generator", "machine", "libraries", SHA-256 of the package's files
            ("package") and of the "published" bits, "features" (use case, effect of an error, tool
            impact, what detects it, error detection), "results", SHA-256 of these ("digest").
            A result is a case with its "checks", each with what is "expected" and was "found".
    """

    facts: dict[str, Any]

    @property
    def results(self) -> list[dict[str, Any]]:
        """The cases."""
        found: list[dict[str, Any]] = self.facts["results"]
        return found

    def failed(self, *kinds: str) -> list[str]:
        """Return the ids of the cases of some kinds that fail."""
        return [one["id"] for one in self.results if one["kind"] in kinds and not one["passed"]]

    @property
    def figures(self) -> dict[str, float]:
        """Those of `FIGURES`."""
        failed = {name: float(len(self.failed(*kinds))) for name, kinds in FIGURES.items()}
        return failed | {"cases": float(len(self.results))}

    @property
    def verdict(self) -> str:
        """The suite in one sentence or two, what is wrong first."""
        wrong, other = self.failed("answer", "law"), self.failed("bits")
        if not wrong and not other:
            return f"All {len(self.results)} cases of the validation suite pass."
        said = f"Wrong answers in {counted(len(wrong), 'case')}: {', '.join(wrong)}."
        bits = f"Other bits than the published ones, right or wrong: {', '.join(other)}."
        return " ".join([said] * bool(wrong) + [bits] * bool(other))

    def judged(self, suite: str, figures: dict[str, float]) -> Judged:
        """Return what fail conditions are applied to: every case must pass."""
        return Judged(
            suite=suite, group="bridgegen.validation", test="the validation suite passes",
            holds=not self.failed(*FIGURES["cases"]), details=self.verdict,
            figures=figures | self.figures, facts={},
        )  # fmt: skip


def validate(callbacks: JobCallbacks | None = None) -> Protocol:
    """Run the suite: half a minute once kernels are compiled, else minutes more."""
    say = callbacks or JobCallbacks()
    say.compile()
    every, results = every_case(), []
    for number, case in enumerate(every):
        say.progress("validating", number, len(every), case.id)
        results.append(result_of(case))
    root, package = HERE.parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts and "_kernels" not in path.parts:
            package.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    published = (root / "engine" / "conformance.json").read_bytes()
    return Protocol({
        "schema_version": 1,
        "generator": f"BridgeGen {version('bridgegen')}",
        "machine": f"{platform.python_implementation()} {platform.python_version()}, "
        f"{platform.system()} {platform.machine()}",
        "libraries": {name: version(name) for name in ("numpy", "numba", "llvmlite")},
        "package": package.hexdigest(),
        "published": hashlib.sha256(published).hexdigest(),
        "features": data()["features"],
        "results": results,
        "digest": hashlib.sha256(json.dumps(results, sort_keys=True).encode()).hexdigest(),
    })  # fmt: skip


def every_case() -> list[Case]:
    """Return all cases; known answers and laws first."""
    return [*cases(), *_bits()]


def result_of(case: Case) -> dict[str, Any]:
    """Run a case; one that raises, or yields nothing, fails."""
    checks: list[dict[str, Any]] = []
    try:
        checks += (
            {"name": check.name, "expected": _plain(check.expected), "found": _plain(check.found),
             "tolerance": check.tolerance, "passed": check.passed}
            for check in case.checks()
        )  # fmt: skip
    except Exception as error:  # whatever is wrong with this case, the others are run
        why = f"{type(error).__name__}: {error}"[:500]
        checks.append({"name": "raises", "expected": "", "found": why, "tolerance": 0.0,
                       "passed": False})  # fmt: skip
    passed = bool(checks) and all(one["passed"] for one in checks)
    about = {name: getattr(case, name) for name in ("id", "feature", "kind", "what")}
    return about | {"passed": passed, "checks": checks}


def _plain(value: Any) -> float | str:
    """Return a value as JSON has it, which knows no infinity."""
    if isinstance(value, str):
        return value
    return float(value) if isfinite(value) else str(float(value))


def _bits() -> Iterator[Case]:
    """Yield the cases of the published digests: functions, then each driver in all scenarios."""
    published = conformance.published()

    def functions() -> Iterator[Check]:
        got = conformance.function_digests()
        return (Check(name, published["functions"][name], got[name]) for name in FUNCTIONS)

    def verdicts(driver: str) -> Iterator[Check]:
        for name, digest in conformance.verdict_digests([driver]).items():
            yield Check(name, published["verdicts"][name], digest)

    yield Case("B1", "bits", "bits", "Elementary functions at 10,000 arguments.", functions)
    rows = f"Motion, metrics and verdicts of {conformance.SAMPLE} rows of each scenario, driven by"
    for number, driver in enumerate(conformance.SHIPPED, start=2):
        what = f"{rows} {driver}."
        yield Case(f"B{number}", "bits", "bits", what, partial(verdicts, driver))


@dataclass(frozen=True)
class ToolValidated:
    """The suite's protocol on disk.

    Attributes:
        protocol: it.
        file: that holds it.
        known: names of all figures of the job; those of runs are not known here.
    """

    protocol: Protocol
    file: Path
    known: Sequence[str]

    @property
    def work(self) -> str:
        """How many cases were run."""
        return counted(len(self.protocol.results), "case")

    def to_json(self) -> dict[str, object]:
        """Return the protocol as JSON's types."""
        return self.protocol.facts

    def shown(self) -> list[str | Table]:
        """Return the verdict, each case, and what differs."""
        results = self.protocol.results
        rows = [
            (one["id"], "passes" if one["passed"] else "FAILS", one["kind"], one["what"])
            for one in results
        ]
        bad = [
            f"{one['id']}, {at['name']}: expected {at['expected']}, found {at['found']}"
            for one in results
            for at in one["checks"]
            if not at["passed"]
        ]
        table = Table(("case", "result", "known by", "what"), rows)
        return [f"{self.protocol.verdict}\n", table, *bad[:20], f"\n{'protocol':<12}{self.file}"]

    def judged(self) -> list[Judged]:
        """Return whether every case passes."""
        return [self.protocol.judged(str(self.file), dict.fromkeys(self.known, nan))]
