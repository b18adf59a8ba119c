"""An assessor's key, whose hash is published before; and the sealed result of what it draws."""

import hashlib
import json
import os
import secrets
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, Field

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.base.records import read_bytes, read_model
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.drivers.identity import digest_of, identity_of, labels_of
from bridgegen.jobs.suite.difference import difference
from bridgegen.jobs.suite.drawn import BESIDE, BOUND, INSIDE, OUTSIDE, Draw, drawn, numbers
from bridgegen.jobs.suite.entries import Entry, find_entries
from bridgegen.jobs.suite.evaluate import (
    Job,
    evaluate,
    pipeline_of,
    rows_of_job,
    scenario_of,
    written,
)
from bridgegen.jobs.suite.failing import seeking_causes, ways
from bridgegen.jobs.suite.options import SAMPLES, SUITE, SuiteOptions
from bridgegen.jobs.suite.replay import job_of
from bridgegen.jobs.suite.results import EntryResult, Strict, counts, rank
from bridgegen.jobs.suite.suite import (
    SEALED,
    SuiteRun,
    check,
    default_folder,
    run_entries,
    settings_of,
)
from bridgegen.simulation.choice import EMBEDDED

BEYOND = "outside.jsonl"
"""File in the folder of the results, of what lies outside the ranges."""

REGISTER = "assessor-keys.jsonl"
"""File beside a key, and beside the folders of results, of the keys that were used."""

LEAST, MOST = 10, 100_000
"""Number of variations that a key draws of a scenario at least, and of all with all drivers at
most: a sealed file of more could not be read."""


class Key(Strict):
    """An assessor's key: 32 random bytes, of which scenarios it draws, and what judges these.

    Scenarios are digests by name; ``judged`` has the settings that bound and judge.
    """

    assessor: Literal[1] = 1
    secret: str = Field(pattern="^[0-9a-f]{64}$")
    number: int = Field(ge=LEAST, le=MOST)
    scenarios: dict[str, str]
    judged: dict[str, Any]
    version: str
    commitment: str = ""

    def require(self, entries: Sequence[Entry], settings: Mapping[str, Any], place: Path) -> None:
        """Refuse what is not as it was committed to: key, scenarios, what judges them, version.

        Raises:
            InputError: it is not.
        """
        if self.commitment != (own := hash_of(self, "commitment")):
            raise InputError(
                f"{place}: the key must match its published hash {self.commitment[:64]}, its own "
                f"is {own}"
            )
        if self.version != version("bridgegen"):
            raise InputError(f"{place}: was drawn by another version: {self.version[:40]}")
        if odd := [name for name, was in self.judged.items() if was != _judged(settings)[name]]:
            raise InputError(
                f"{place}: what bounds and judges must be as the key says; not: {', '.join(odd)}"
            )
        known, given = {*self.scenarios.values()}, {entry.digest for entry in entries}
        odd = [name for name, digest in self.scenarios.items() if digest not in given]
        odd += [entry.name for entry in entries if entry.digest not in known]
        if odd:
            names = ", ".join(dict.fromkeys(odd))[:200]
            raise InputError(
                f"{place}: scenarios must be those of the key, unchanged; not: {names}"
            )


class Failure(Strict):
    """A variation that fails: its number from 1 on, where it lies, its mode and root cause."""

    entry: str
    ego: str
    number: int
    drawn: str
    title: str
    cause: str


class Sealed(Strict):
    """A sealed result: the key, revealed, and what it drew; what lies outside fails nothing."""

    sealed: Literal[1] = 1
    key: Key
    settings: dict[str, Any]
    results: list[EntryResult]
    outside: list[EntryResult]
    failures: list[Failure]
    seal: str = ""


def hash_of(model: BaseModel, without: str) -> str:
    """Return the SHA-256 of a record without the field that holds it, in hexadecimal digits."""
    text = json.dumps(model.model_dump(exclude={without}), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _judged(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of a suite's settings bounds and judges, an ODD by its digest."""
    names = ("criteria", "critical", "count", "others", "empty_trigger")
    found: dict[str, Any] = json.loads(json.dumps({name: settings[name] for name in names}))
    return {"odd": (settings.get("odd") or {}).get("sha256")} | found


def commit(path: Path, files: Sequence[str], number: int, **judged: Any) -> list[str]:
    """Write a new key, which only its owner can read, and return what to say of it.

    Args:
        path: of the key.
        files: the scenarios.
        number: of variations of each.
        judged: options of the suite that bound and judge them; see `_judged`.

    Raises:
        InputError: a scenario cannot be read, or the number is out of range.
        StorageError: the file exists, or cannot be written.
    """
    entries = find_entries(files)
    most = MOST // len(entries)
    if not LEAST <= number <= most:
        raise InputError(f"--number must be {LEAST} to {most:,}, got {number:,}")
    if broken := [entry.name for entry in entries if entry.problem or not entry.digest]:
        raise InputError(f"cannot be read: {', '.join(broken)}")
    digests, ours = {entry.name: entry.digest for entry in entries}, version("bridgegen")
    given = settings_of(SuiteOptions(files=files, **judged), EMBEDDED)
    key = Key(
        secret=secrets.token_hex(32),
        number=number,
        scenarios=digests,
        judged=_judged(given),
        version=ours,
    )
    key = key.model_copy(update={"commitment": hash_of(key, "commitment")})
    try:
        # Never over another key: its hash may be published.
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(key.model_dump_json(indent=1) + "\n")
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    parts = ", ".join(f"{count} {name}" for name, count in numbers(number).items())
    return [
        f"key         {path}: keep it secret until the suite has run; it serves once",
        f"scenarios   {len(entries)}, of each {number} variations: {parts}",
        f"publish     {key.commitment}",
        "            where it gets a date that others trust: no file proves when it was made",
    ]


def assess(given: SuiteOptions, key_file: Path) -> SuiteRun:
    """Run what an assessor's key draws, and seal the result.

    Raises:
        InputError: the key was used before, is of other scenarios, or does not match its hash.
    """
    files = [given.files] if isinstance(given.files, str | Path) else list(given.files)
    key = _read(key_file, Key)
    key.require(entries := find_entries(files), settings_of(given, given.simulator), key_file)
    if key.number * len(entries) * len({*given.egos}) > MOST:
        raise InputError(f"variations of all drivers must be {MOST:,} at most: name fewer (--ego)")
    if (given.samples, given.seed, given.matrix) != (SAMPLES, 0, None):
        raise InputError("--samples, --seed and --matrix choose variations, as --assessor does")
    check(given, given.simulator)
    home = default_folder(files)
    folder = Path(given.out or home.with_name(f"{home.name}-{key.commitment[:8]}"))
    _spend(key, key_file, folder, [identity_of(ego, digest_of(ego)).content for ego in given.egos])
    given, draw = replace(given, out=folder), Draw(key.secret, key.number)
    suite = run_entries(SUITE, given, draw)
    outside = run_entries(SUITE, given, replace(draw, outside=True), BEYOND).results
    made = Sealed(
        key=key,
        settings=json.loads(json.dumps(suite.settings)),
        results=[*suite.results],
        outside=[*outside],
        failures=_failures(suite.jobs, suite.results),
    )
    made = made.model_copy(update={"seal": hash_of(made, "seal")})
    write_whole(folder / SEALED, [made.model_dump_json().encode()])
    return replace(suite, sealed=made)


def verify(
    path: Path, files: Sequence[str], published: Sequence[str], egos: Sequence[str]
) -> tuple[list[str], bool]:
    """Verify a sealed result: its seal, its key's hash, its variations; and run it again.

    Args:
        path: of the sealed file. No file or code that it names is opened.
        files: the scenarios.
        published: the key's hash, and the seal, as they were published.
        egos: drivers. One of the file's, unchanged, must have each result again, to the bit, with
            its root cause; any other one is a re-test of its failures.

    Returns:
        What was verified, and what not, in lines; and whether a variation of a re-test fails or
        did not run.

    Raises:
        InputError: it was altered, is not what was published, or its scenarios have changed.
        StorageError: it cannot be read.
    """
    sealed, entries = _read(path, Sealed), find_entries(files)
    known = {sealed.key.commitment: "the key's hash", sealed.seal: "the seal"}
    sealed.key.require(entries, sealed.settings, path)
    if sealed.seal != hash_of(sealed, "seal"):
        raise InputError(f"{path}: was altered: its content does not have the seal {sealed.seal}")
    if odd := [text for text in published if text not in known]:
        kept = " and ".join(f"{name} is {text}" for text, name in known.items())
        raise InputError(f"{path}: is not what was published as {odd[0][:80]}: {kept}")
    jobs = list(_jobs(path, sealed, entries))
    texts = ", ".join(known[text] for text in published) or "nothing compared (--published HASH)"
    unrun = sum(bool(result.problem) for _, result in jobs)
    again = [_again(path, sealed, jobs, ego) for ego in egos]
    lines = [
        *(f"{name:<16}{text}" for text, name in known.items()),
        f"published       {texts}",
        f"variations      {sum(len(result.rows) for _, result in jobs):,}, as the key draws them"
        + (f"; {unrun} results did not run" if unrun else ""),
        *(line for of_ego, _ in again for line in of_ego),
        *([] if egos else ["run again       nothing (--ego DRIVER)"]),
    ]
    return lines, any(fails for _, fails in again)


def _jobs(
    path: Path, sealed: Sealed, entries: Sequence[Entry]
) -> Iterator[tuple[Job, EntryResult]]:
    """Yield what was run, of the scenarios that the user names, with its verified results."""
    of = {entry.digest: entry for entry in entries}
    suite = SuiteRun(path.parent, (), (), sealed.settings)
    for outside, results in ((False, sealed.results), (True, sealed.outside)):
        draw = Draw(sealed.key.secret, sealed.key.number, outside)
        for ego in {result.ego for result in (*sealed.results, *sealed.outside)} or {""}:
            digests = [result.digest for result in results if result.ego == ego]
            if sorted(digests) != sorted(entry.digest for entry in entries):
                raise InputError(f"{path}: was altered: results of '{ego[:80]}' are missing")
        for result in results:
            entry = replace(of[result.digest], name=result.entry)
            named = {"scenario": entry.scenario, "distribution": entry.distribution or ""}
            job = replace(job_of(suite, result.model_copy(update=named)), entry=entry, draw=draw)
            scenario = scenario_of(job)
            space = scenario.space()
            found = drawn(scenario, space, draw, entry.digest)
            values = written(scenario, space, found.X, found.names)
            expected = [[name, *x] for name, x in zip(found.strata, values, strict=True)]
            if not (result.problem and not result.rows) and [r.x for r in result.rows] != expected:
                raise InputError(f"{path}: was altered: the key draws others of {entry.name}")
            yield job, result


def _again(
    path: Path, sealed: Sealed, jobs: Sequence[tuple[Job, EntryResult]], ego: str
) -> tuple[list[str], bool]:
    """Return what a driver makes of the sealed variations: the same again, or a re-test.

    A re-test fails as a suite does.
    """
    own = identity_of(ego, digest_of(ego))
    who = [identity_of(old.ego or old.driver, old.driver_digest) for _, old in jobs]
    same = [pair for pair, driver in zip(jobs, who, strict=True) if driver.content == own.content]
    before = same or [pair for pair in jobs if pair[1].ego == jobs[0][1].ego]
    again, results = [replace(job, ego=ego) for job, _ in before], list[EntryResult]()
    for job, (_, old) in zip(again, before, strict=True):
        named = {"ego": old.ego, "scenario": old.scenario, "distribution": old.distribution}
        results.append(evaluate(job).model_copy(update=named))
    n = sum(job.draw is not None and not job.draw.outside for job in again)  # which come first
    if same:
        failures = [one for one in sealed.failures if one.ego == before[0][1].ego]
        if [old for _, old in same] != results or _failures(again[:n], results[:n]) != failures:
            raise InputError(f"{path}: was altered, or {ego} has chance in it: results differ")
        return [f"run again       {ego}: the same results and root causes, to the bit"], False
    first, second = labels_of([who[0], own])
    found = difference([old for _, old in before[:n]], results[:n], (first, second))
    changes = {(row.entry, row.row + 1): row.change for row in found.rows}
    lines = [f"re-test         {found.headline}"]
    for one in sealed.failures:
        if one.ego == before[0][1].ego:
            change = changes.get((one.entry, one.number), "not comparable")
            cause = one.cause or "no cause found"
            lines.append(f"  {one.entry} {one.number}, {change}: {one.title} · {cause}")
    number, unsure = counts(results[:n]), any(r.verdict == "not judged" for r in results[:n])
    return lines, bool(number["failed"] or number["not run"] or unsure)


def _failures(jobs: Iterable[Job], results: Iterable[EntryResult]) -> list[Failure]:
    """Return each failed variation with its root cause, the worst first."""
    made = []
    for job, result in zip(jobs, results, strict=True):
        failed = [i for i, row in enumerate(result.rows) if row.verdict == "failed"]
        if not failed:
            continue
        pipeline = pipeline_of(seeking_causes(job))
        for i, way in zip(failed, ways(pipeline, rows_of_job(job, pipeline)[failed]), strict=True):
            failure = Failure(
                entry=result.entry,
                ego=result.ego,
                number=i + 1,
                drawn=str(result.rows[i].x[0]),
                title="violates a clause" if way.problem else way.title,
                cause=way.key.cause,
            )
            row = result.rows[i]
            made.append(((-row.severity, *rank(row)), failure))
    return [failure for _, failure in sorted(made, key=lambda one: one[0])]


def _read(path: Path, model: Any) -> Any:
    found = read_model(
        path, model, lambda place, why: FileFormatError(f"{place}: is no {model.__name__}: {why}")
    )
    if found is None:
        raise InputError(f"{path}: no such file")
    return found


def _spend(key: Key, path: Path, folder: Path, drivers: Sequence[str]) -> None:
    """Register that a key is used; a run that was stopped may be resumed, with its drivers.

    Raises:
        InputError: it was used before.
        StorageError: a register cannot be read or written.
    """
    use = json.dumps([key.commitment, folder.name, *drivers])
    for register in {home.resolve() / REGISTER for home in (path.parent, folder.parent)}:
        try:
            register.parent.mkdir(parents=True, exist_ok=True)
            lines = read_bytes(register).decode().splitlines() if register.exists() else []
            before = [line for line in lines if key.commitment in line]
            if before and (before != [use] or (folder / SEALED).exists()):
                raise InputError(
                    f"{path}: this key was used before ({register.name}); make another"
                )
            if not before:
                with register.open("a") as file:
                    file.write(use + "\n")
        except (OSError, ValueError) as error:
            raise StorageError(f"{register}: cannot be read or written: {error}") from None


def sealed_lines(sealed: Sealed, ego: str) -> list[str]:
    """Return what an ego makes of what was drawn, with the worst failure and its root cause."""
    counted = Counter(
        (str(row.x[0]), verdict)
        for result in (*sealed.results, *sealed.outside)
        if result.ego == ego
        for row, verdict in zip(result.rows, result.verdicts, strict=True)
    )
    texts = []
    for name in (INSIDE, BOUND, BESIDE, OUTSIDE):
        failed, n = counted[name, "failed"], counted[name, "failed"] + counted[name, "passed"]
        low, high = clopper_pearson(failed, n)
        share = f" ({percent(low)} to {percent(high)})" if n else ""
        lost = counted[name, "not judged"] + counted[name, "not run"]
        more = f", {lost} not judged" if lost else ""
        texts.append(f"{name} {failed} of {n} fail{share}{more}")
    *within, outside = texts
    made = [
        f"Drawn by an assessor (95 % intervals): {'; '.join(within)}",
        f"Not counted: {outside}",
    ]
    if worst := next((failure for failure in sealed.failures if failure.ego == ego), None):
        cause = worst.cause or "not found"
        made.append(f"Worst: {worst.entry} {worst.number} {worst.title}; root cause: {cause}")
    return made
