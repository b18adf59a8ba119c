"""Results of a project: a scenario driven by one driver; what both are called."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Literal

from bridgegen.drivers import is_remote, is_spec
from bridgegen.drivers.identity import Identity, identity_of, labels_of
from bridgegen.scenario.language.criteria import Criterion
from bridgegen.search.triage.record import Estimate

# --- What scenarios and drivers are called in a project, the same on every machine ---


_VERSION = re.compile(r"[-_@]v?([0-9]+(?:[._][0-9]+)*)$")
_SUFFIXES = (".py", ".fmu")
_UNKNOWN = Identity("", "")


@dataclass(frozen=True, order=True)
class Driver:
    """A system under test, and which version of it.

    Attributes:
        name: without the version: what failure modes and requirements are about.
        version: of the name, "1.2" of ``stack-1.2``; of a driver that ships BridgeGen's; "" where
            nothing says it.
        label: as people call it.
        identity: by its content; empty where no file of it is known.
    """

    name: str
    version: str
    label: str
    identity: Identity = _UNKNOWN


def scenario_name(text: str, project: Path, distribution: str = "") -> str:
    """Return what a scenario is called: its name, or where its file is in the project.

    Args:
        text: as a run or suite records it: a name, or a path.
        project: folder of the project.
        distribution: the file with its variations, if there is one: it names the scenario.
    """
    given = distribution or text
    is_path = given.lower().endswith((".yaml", ".yml", ".osc", ".xosc"))
    return place_of(given, project) if is_path else given


def driver_of(
    text: str, project: Path, bridgegen: str, digest: str = "", called: str = ""
) -> Driver:
    """Return the driver of a result.

    A version ends a part of the name behind ``-``, ``_`` or ``@``: ``stack-1.2``,
    ``stack_v3.py:Stack``, ``builds/stack@7/driver.py:Stack``.

    Args:
        text: as a run or suite records it.
        project: folder of the project.
        bridgegen: version of BridgeGen that made the result.
        digest: of its files, as recorded; "" of earlier results and of drivers without files.
        called: the name that the user gave it (``--name``), or "".
    """
    if digest or called:
        plain = driver_of(called or text, project, bridgegen)
        label = called or plain.label
        return Driver(plain.name, plain.version, label, identity_of(text, digest, called))
    if is_remote(text):
        return Driver(text, "", text)
    if not is_spec(text):
        name, version = _split(text)
        return Driver(name, version or f"BridgeGen {bridgegen}", text)
    file, _, cls = (text, "", "") if text.endswith(".fmu") else text.rpartition(":")
    label = place_of(file, project)
    parts, version = [], ""
    for part in PurePosixPath(label).parts:
        bare, found = _split(part)
        parts.append(bare)
        version = found or version
    end = f":{cls}" if cls else ""
    return Driver("/".join(parts) + end, version, label + end)


def _split(part: str) -> tuple[str, str]:
    """Return a part of a name without its version, and the version."""
    suffix = next((name for name in _SUFFIXES if part.endswith(name)), "")
    stem = part.removesuffix(suffix)
    found = _VERSION.search(stem)
    if found is None or not found.start():
        return part, ""
    return stem[: found.start()] + suffix, found[1]


def place_of(text: str, project: Path) -> str:
    """Return where a file is, as seen from the project's folder; by its name if far from it."""
    path = Path(text)
    if not path.is_absolute():
        tried = (project / path, project.parent / path, Path.cwd() / path)
        # The same file from wherever a run was started: two machines name one scenario.
        path = next((item for item in tried if item.exists()), path)
        if not path.is_absolute():
            return path.as_posix()
    try:
        return path.relative_to(project).as_posix()
    except ValueError:
        pass
    try:
        return "../" + path.relative_to(project.parent).as_posix()
    except ValueError:
        return "/".join(path.parts[-2:])


Kind = Literal["run", "difference", "suite"]
"""Kind of a result; a run that counts only what another driver avoids (``--worse-than``) is a
difference."""


@dataclass(frozen=True, order=True)
class ModeKey:
    """What makes two failures of different results the same: the triage's key without the cause.

    A suite records no place, and the other participant by its name; so its modes are
    its own. The violation of a requirement is a mode, too.

    Attributes:
        scenario: in which the driver fails.
        driver: without its version.
        conflict: see `bridgegen.search.triage.modes.Key`, as the next four.
        conflict_type: its type.
        responsible: the responsible party.
        partner: the other participant.
        place: on the ego's route.
        requirement: the id of the pass criterion that is violated, or "".
    """

    scenario: str
    driver: str
    conflict: str = ""
    conflict_type: str = ""
    responsible: str = ""
    partner: str = ""
    place: str = ""
    requirement: str = ""

    @property
    def id(self) -> str:
        """Short and the same on every machine: a digest of all of it, never like a number."""
        text = "\0".join(vars(self).values())
        # With letters in front: YAML reads a digest of digits, or like 1e5, as a number.
        return f"fm-{sha256(text.encode('utf-8', 'surrogatepass')).hexdigest()[:10]}"


@dataclass(frozen=True)
class Failure:
    """A failure mode in one result.

    Attributes:
        key: of it.
        title: in words.
        count: of evaluations or variations.
        severity: the worst probability of MAIS3+.
        knife_edge: whether small changes of the parameters make it vanish.
        searched: the scenario of a run as suites that grow call it; else "".
    """

    key: ModeKey
    title: str
    count: int
    severity: float = 0.0
    knife_edge: bool = False
    searched: str = ""


@dataclass(frozen=True)
class Judged:
    """How a result meets a requirement.

    Attributes:
        criterion: it.
        met: number of evaluations that meet it.
        violated: number of those that violate it.
        unknown: number of those without a result.
        worst: the least margin; None where there is none.
        unit: of the margin.
    """

    criterion: Criterion
    met: int
    violated: int
    unknown: int
    worst: float | None
    unit: str


@dataclass
class Seen:
    """Which values of a scenario were evaluated.

    Attributes:
        evaluations: with a result.
        bins: by parameter, evaluations in each bin of its declared range.
        outside: by parameter, evaluations beyond that range.
        bands: by quantity, evaluations in each of its bands, see
            `bridgegen.jobs.dashboard.scenery.BANDS`.
    """

    evaluations: int = 0
    bins: dict[str, list[int]] = field(default_factory=dict)
    outside: dict[str, int] = field(default_factory=dict)
    bands: dict[str, list[int]] = field(default_factory=dict)

    def add(self, other: "Seen") -> None:
        """Add what another result evaluated.

        Of two scenarios with one name, bins that are not the same are those of the first.
        """
        self.evaluations += other.evaluations
        for mine, its in ((self.bins, other.bins), (self.bands, other.bands)):
            for name, counts in its.items():
                held = mine.setdefault(name, [0] * len(counts))
                # A scenario whose bins have changed since cannot be added up.
                if len(held) == len(counts):
                    mine[name] = [a + b for a, b in zip(held, counts, strict=True)]
        for name, count in other.outside.items():
            self.outside[name] = self.outside.get(name, 0) + count


@dataclass(frozen=True)
class Result:
    """A scenario, driven by one driver.

    Attributes:
        kind: a run, also one that compares two drivers, or an entry of a suite with one ego.
        source: folder, as seen from the project's.
        page: where its page is, as seen from the project's folder; "" if there is none.
        time: when its file was last written [s since 1970].
        scenario: see `bridgegen.jobs.dashboard.results.scenario_name`.
        driver: see `bridgegen.jobs.dashboard.results.driver_of`.
        evaluations: number of evaluations, or of variations.
        failed: number of those that harm; of a suite's that fail.
        lost: number of those without a result.
        space: harmful share of the search space, of a finished run that compares no drivers.
        finished: whether all is done.
        failures: its failure modes.
        judged: its requirements.
        seen: which values were evaluated; None where the scenario cannot be read any more.
        entry: of the suite, by name.
        ego: the driver of the entry, as the suite records it.
        worse_than: the driver that a difference is of, as people call it; else "".
        unjudged: whether it says nothing of the driver, see
            `bridgegen.search.triage.record.Bound.judged`.
        covered: how many fresh random failures are of a mode that was found, and of how many; None
            where it is not known.
    """

    kind: Kind
    source: str
    page: str
    time: float
    scenario: str
    driver: Driver
    evaluations: int
    failed: int
    lost: int
    finished: bool
    space: Estimate | None = None
    failures: tuple[Failure, ...] = ()
    judged: tuple[Judged, ...] = ()
    seen: Seen | None = field(default=None, repr=False, compare=False)
    entry: str = ""
    ego: str = ""
    worse_than: str = ""
    unjudged: bool = False
    covered: tuple[int, int] | None = None


def in_order(results: Iterable[Result]) -> list[Result]:
    """Return results by time; equal ones by their folder."""
    return sorted(
        results, key=lambda result: (result.time, result.source, result.entry, result.driver)
    )


def current(results: Iterable[Result]) -> list[Result]:
    """Return the results that say how things stand.

    Of each scenario, driver and kind of result: those of the version that was tested last. Where
    no version is known, the latest alone: an earlier one may be of other software. What has not
    finished says nothing against what has: its failures are not known yet.
    """
    held: dict[tuple[str, str, str], list[Result]] = {}
    for result in in_order(results):
        held.setdefault((result.scenario, result.driver.name, result.kind), []).append(result)
    found = []
    for some in held.values():
        # Results of the version that was tested last are current, all of them; where the version is
        # not known, the latest alone.
        last = next((result for result in reversed(some) if result.finished), some[-1])
        version = last.driver.version
        found += (
            [result for result in some if result.driver.version == version] if version else [last]
        )
    return in_order(found)


def as_one(results: Iterable[Result]) -> dict[Driver, Driver]:
    """Return what each driver with an identity is called in all results: one of one content.

    Its name is that of its first result, whatever path later ones give. Its label is its class
    alone if no file of another name has such a class. Later contents under a label are "changed".
    """
    drivers = [result.driver for result in in_order(results) if result.driver.identity.content]
    first: dict[Identity, Driver] = {}
    for driver in drivers:
        first.setdefault(driver.identity, driver)
    files: dict[str, set[str]] = {}
    for identity, driver in first.items():
        files.setdefault(identity.name, set()).add(PurePosixPath(driver.name).name)
    plain = [
        driver.label
        if driver.version
        else PurePosixPath(driver.label).name
        if len(files[identity.name]) > 1
        else identity.name
        for identity, driver in first.items()
    ]
    labels = labels_of(
        [Identity(name, own.content) for name, own in zip(plain, first, strict=True)]
    )
    made = {
        own: replace(driver, label=label)
        for (own, driver), label in zip(first.items(), labels, strict=True)
    }
    return {driver: made[driver.identity] for driver in drivers}


def versions(results: Iterable[Result]) -> Mapping[str, list[Driver]]:
    """Return the versions of each driver, in the order of first appearance."""
    found: dict[str, dict[Driver, None]] = {}
    for result in in_order(results):
        found.setdefault(result.driver.name, {})[result.driver] = None
    return {name: list(some) for name, some in found.items()}
