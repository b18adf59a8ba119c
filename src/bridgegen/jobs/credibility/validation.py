"""The validation suite: what the installed package answers to cases whose answer is known.

`validate` runs it, offline and with nothing but the package. Its protocol is ``validation.json``.
"""

import hashlib
import json
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from bridgegen.base._elementary_kernels import FUNCTIONS
from bridgegen.engine import conformance
from bridgegen.jobs.credibility.known_answers import CASES, Case, Kind
from bridgegen.jobs.frame import JobCallbacks, Judged, Table
from bridgegen.pages.templates import counted

FILE = "validation.json"

Level = Literal["TI1", "TI2", "TD1", "TD2", "TD3"]

FEATURES: dict[str, tuple[str, str, Level, str, Level]] = {
    "metrics": ("Criticality of recorded or simulated motion is measured",
                "a critical scenario is ranked as harmless, and not exported", "TI2",
                "cases M1 to M6; esmini and shapely in tests of the source", "TD1"),
    "verdicts": ("It is decided what happened, who is responsible, and whether the ego fails",
                 "a failure of the ego is passed over, or another's is counted as its own", "TI2",
                 "cases C1 to C4; a person sees the playback of each failure, not of the rest", "TD2"),
    "severity": ("Failures are ranked by the probability of serious injury",
                 "a severe failure stands behind light ones", "TI2", "cases S1 and S2", "TD1"),
    "simulation": ("Vehicles and traffic move as the storyboard says",
                   "a collision is missed, or one that could not be is reported", "TI2",
                   "cases D1 to D3; confirm in another simulator, of exported scenarios", "TD2"),
    "drivers": ("Reference drivers say what is preventable; they stand in for a system under test",
                "a preventable collision is called not preventable", "TI2",
                "cases E1 to E4; the Commission's code in tests of the source", "TD1"),
    "invariance": ("Results depend on the scenario alone, not on batch, order or place",
                   "the same scenario is judged in two ways", "TI2", "cases L1 and L2", "TD1"),
    "bits": ("A result is the same on any machine", "a reviewer cannot reproduce a finding", "TI2",
             "cases B1 to B7; they see that something changed, not that it is right", "TD2"),
}  # fmt: skip
"""By feature: its use case, what an error would do, the tool impact that is proposed, what detects
it, and the error detection that is proposed. Terms of ISO 26262-8, clause 11, which was not read:
people decide."""


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Found(_Model):
    """A number of a case, or a digest.

    Attributes:
        name: of it, with its unit.
        expected: it; "inf" is a text, as JSON has no such number.
        found: what this installation gives; a text if it is a digest, or why it gives nothing.
        tolerance: the greatest difference that passes.
        passed: whether it does.
    """

    name: str
    expected: float | str
    found: float | str
    tolerance: float
    passed: bool


class Result(_Model):
    """A case with what was found.

    Attributes:
        id: of it.
        feature: key of `FEATURES`.
        kind: how its answer is known, see `known_answers.Kind`.
        what: it verifies.
        passed: whether all its numbers agree.
        checks: these.
    """

    id: str
    feature: str
    kind: Kind
    what: str
    passed: bool
    checks: tuple[Found, ...]


class Protocol(_Model):
    """The protocol of the suite, ``validation.json``.

    Attributes:
        schema_version: 1.
        generator: what ran it.
        machine: interpreter, system and processor.
        libraries: versions of those that decide on results.
        package: SHA-256 of the package's files, in the order of their paths.
        published: SHA-256 of the published digests that bits are compared with.
        features: use case, tool impact and error detection by feature, proposals to people.
        results: of each case.
        digest: SHA-256 of the results as JSON.
    """

    schema_version: Literal[1] = 1
    generator: str
    machine: str
    libraries: dict[str, str]
    package: str
    published: str
    features: dict[str, tuple[str, str, Level, str, Level]]
    results: tuple[Result, ...]
    digest: str

    def failed(self, *kinds: Kind) -> list[str]:
        """Return the ids of the cases of some kinds that fail."""
        return [one.id for one in self.results if one.kind in kinds and not one.passed]

    @property
    def verdict(self) -> str:
        """The suite in one sentence, what is wrong first."""
        wrong, other = self.failed("answer", "law"), self.failed("bits")
        said = [f"Wrong answers in {counted(len(wrong), 'case')}: {', '.join(wrong)}."] * bool(wrong)
        said += [f"Other bits than the published ones, right or wrong: {', '.join(other)}."] * bool(other)
        return " ".join(said) or f"All {len(self.results)} cases of the validation suite pass."


def validate(callbacks: JobCallbacks | None = None) -> Protocol:
    """Run the suite: some half a minute once kernels are compiled, else minutes more."""
    say = callbacks or JobCallbacks()
    say.compile()
    cases = [*CASES, *_bits()]
    results = []
    for number, case in enumerate(cases):
        say.progress("validating", number, len(cases), case.id)
        results.append(_run(case))
    text = json.dumps([one.model_dump() for one in results], sort_keys=True)
    root = Path(str(files("bridgegen")))
    package = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts and "_kernels" not in path.parts:
            package.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return Protocol(
        generator=f"BridgeGen {version('bridgegen')}",
        machine=f"{platform.python_implementation()} {platform.python_version()}, "
        f"{platform.system()} {platform.machine()}",
        libraries={name: version(name) for name in ("numpy", "numba", "llvmlite")},
        package=package.hexdigest(),
        published=hashlib.sha256((root / "engine" / "conformance.json").read_bytes()).hexdigest(),
        features=FEATURES,
        results=tuple(results),
        digest=hashlib.sha256(text.encode()).hexdigest(),
    )


def _run(case: Case) -> Result:
    """Run a case; one that raises, or yields nothing, fails."""
    found: list[Found] = []
    try:
        for check in case.checks():
            same = check.passed
            found.append(_found(*check, passed=bool(same)))
    except Exception as error:  # whatever a fault does, the other cases are run
        why = f"{type(error).__name__}: {error}"[:500]
        found.append(Found(name="raises", expected="", found=why, tolerance=0.0, passed=False))
    passed = bool(found) and all(one.passed for one in found)
    return Result(
        id=case.id, feature=case.feature, kind=case.kind, what=case.what, passed=passed,
        checks=tuple(found),
    )  # fmt: skip


def _found(name: str, expected: Any, found: Any, tolerance: float, *, passed: bool) -> Found:
    def plain(value: Any) -> float | str:
        if isinstance(value, str):
            return value
        return float(value) if abs(float(value)) < float("inf") else str(float(value))

    return Found(name=name, expected=plain(expected), found=plain(found), tolerance=tolerance, passed=passed)


@dataclass(frozen=True)
class _Digest:
    """A check of a digest; as `known_answers.Check`."""

    name: str
    expected: str
    found: str

    @property
    def passed(self) -> bool:
        return self.expected == self.found

    def __iter__(self) -> Iterator[Any]:
        return iter((self.name, self.expected, self.found, 0.0))


def _bits() -> list[Case]:
    """Return the cases of the published digests: functions, then each driver in all scenarios."""
    published = conformance.published()

    def functions() -> Iterator[Any]:
        got = conformance.function_digests()
        return (_Digest(name, published["functions"][name], got[name]) for name in FUNCTIONS)

    def of(driver: str) -> Any:
        def verdicts() -> Iterator[Any]:
            for name, digest in conformance.verdict_digests([driver]).items():
                yield _Digest(name, published["verdicts"][name], digest)

        return verdicts

    rows = f"motion, metrics and verdicts of {conformance.SAMPLE} rows of each scenario, driven by"
    return [
        Case("B1", "bits", "bits", "elementary functions at 10,000 arguments", functions),
        *(
            Case(f"B{number}", "bits", "bits", f"{rows} {driver}", of(driver))
            for number, driver in enumerate(conformance.SHIPPED, start=2)
        ),
    ]  # fmt: skip


@dataclass(frozen=True)
class Validated:
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
        return self.protocol.model_dump(mode="json")

    def shown(self) -> list[str | Table]:
        """Return the verdict, each case, and what differs."""
        results = self.protocol.results
        rows = [(one.id, "passes" if one.passed else "FAILS", one.kind, one.what) for one in results]
        bad = [
            f"{one.id}: {check.name}: expected {check.expected}, found {check.found}"
            for one in results
            for check in one.checks
            if not check.passed
        ]
        table = Table(("case", "result", "known by", "what"), rows)
        return [f"{self.protocol.verdict}\n", table, *bad[:20], f"\n{'protocol':<12}{self.file}"]

    def judged(self) -> list[Judged]:
        """Return whether every case passes."""
        return [judged(self.protocol, str(self.file), dict.fromkeys(self.known, float("nan")))]


def judged(protocol: Protocol, suite: str, figures: dict[str, float]) -> Judged:
    """Return what fail conditions are applied to: of a suite whose cases must all pass."""
    return Judged(
        suite=suite, group="bridgegen.validation", test="the validation suite passes",
        holds=not protocol.failed("answer", "law", "bits"), details=protocol.verdict,
        figures=figures | figures_of(protocol), facts={},
    )  # fmt: skip


def figures_of(protocol: Protocol | None) -> dict[str, float]:
    """Return the figures of the suite; NaN if it was not run."""
    if protocol is None:
        return dict.fromkeys(("cases", "wrong", "other_bits"), float("nan"))
    return {
        "cases": len(protocol.results),
        "wrong": len(protocol.failed("answer", "law")),
        "other_bits": len(protocol.failed("bits")),
    }
