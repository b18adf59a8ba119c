"""The record of a confirmation: its schema, and JSON from which it can be resumed."""

import math
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.objective import Rule
from bridgegen.base.arrays import Float, Numbers
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model
from bridgegen.results.confirmation.differences import (
    DIVERGED,
    TRACE,
    Approach,
    BoxSizes,
    Comparison,
    Contact,
    Divergence,
    EntityDivergence,
    EventTimes,
    LightTimes,
    Offset,
    Track,
)
from bridgegen.scenario.language.thresholds import Thresholds

# --- The schema of a confirmation's record, which is written and checked with these models ---


SCALE = {"x": 100, "y": 100, "h": 1000}
"""Integer units of a track per 1 m or rad."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Whole = Annotated[int, Field(ge=0, le=10**8)]
Units = Annotated[int, Field(ge=-(10**9), le=10**9)]


# Records lie in folders that may come from others: unknown keys, numbers that are not finite and
# whole numbers out of bounds are refused.
class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Margin(_Model):
    """By how much a scenario meets a pass criterion.

    Attributes:
        value: > 0 where it is met, < 0 where it is violated.
        unit: of it; "1" of a mixture or a number.
    """

    value: Number
    unit: str


class Outcome(_Model):
    """The outcome of a scenario in one simulator.

    Attributes:
        critical: by the run's rule, whatever its cause.
        d_min: [m]; None is infinite: the ego is alone.
        v_d: [m/s].
        n_collision: [count].
        F: objectives, minimised.
        contact: the ego's first contact, or None.
        ends: end of the rollout [s]; None if the rollouts were not compared.
        harm: in [0, 1], of the conflicts that the run counts; None in records of earlier versions.
        severity: probability of a MAIS3+ injury; likewise.
        conflict: "contact", "near miss", "collision course", or "" if there is none.
        conflict_type: label of its type.
        responsible: the responsible participant.
        partner: the other participant.
        margins: of the pass criteria that make a scenario critical, by id; empty by other rules.
    """

    critical: bool
    d_min: Number | None
    v_d: Number | None
    n_collision: Number | None
    F: tuple[Number | None, ...]
    contact: Contact | None = None
    ends: Number | None = None
    harm: Number | None = None
    severity: Number | None = None
    conflict: str = ""
    conflict_type: str = ""
    responsible: str = ""
    partner: str = ""
    margins: dict[str, Margin] = {}


class Change(_Model):
    """There minus here.

    Attributes:
        d_min: [m]; None if one of them is infinite.
        v_d: [m/s].
        F: objectives.
        contact: of the time of the first contact [s]; None unless both have one.
        harm: None in records of earlier versions.
    """

    d_min: Number | None
    v_d: Number | None
    F: tuple[Number | None, ...]
    contact: Number | None
    harm: Number | None = None

    @classmethod
    def between(cls, here: Outcome, there: Outcome) -> "Change":
        """Return what changed from here to there."""
        a, b = here.contact, there.contact
        return cls(
            d_min=_minus(there.d_min, here.d_min),
            v_d=_minus(there.v_d, here.v_d),
            F=tuple(_minus(q, p) for p, q in zip(here.F, there.F, strict=True)),
            contact=b.time - a.time if a and b else None,
            harm=_minus(there.harm, here.harm),
        )


class Course(_Model):
    """The track there of an entity that deviates: integers, see SCALE, at the instants of here.

    Attributes:
        entity: its name.
        first: the instant of the first value.
        x: of the reference point; None where the entity is absent.
        y: likewise.
        h: heading.
    """

    entity: str
    first: Annotated[int, Field(ge=0, le=10**6)]
    x: tuple[Units | None, ...]
    y: tuple[Units | None, ...]
    h: tuple[Units | None, ...]

    @model_validator(mode="after")
    def _even(self) -> "Course":
        if not len(self.x) == len(self.y) == len(self.h):
            raise ValueError("x, y and h must be as many")
        return self

    @classmethod
    def of(cls, track: Track) -> "Course":
        """Return a track, rounded."""
        return cls(
            entity=track.entity,
            first=track.first,
            **{name: _units(getattr(track, name) * scale) for name, scale in SCALE.items()},
        )


class Differences(_Model):
    """How the two rollouts differ, see `differences`."""

    partings: tuple[EntityDivergence, ...] = ()
    offsets: tuple[Offset, ...] = ()
    events: tuple[EventTimes, ...] = ()
    lights: tuple[LightTimes, ...] = ()
    boxes: tuple[BoxSizes, ...] = ()
    only_here: tuple[str, ...] = ()
    only_there: tuple[str, ...] = ()
    closest: Approach | None = None
    diverged: tuple[Divergence, ...] = ()

    @classmethod
    def of(cls, found: Comparison) -> "Differences":
        """Return those of a comparison."""
        return cls(**{name: getattr(found, name) for name in cls.model_fields})


class Scenario(_Model):
    """One scenario, here and there.

    Attributes:
        evaluation: its row in the store, from 0.
        name: of its files, if it was exported.
        row: digest of that row, see `record.digest_of`.
        here: the outcome in the run.
        there: the outcome in the other simulator; None if that failed.
        failure: why it failed.
        change: of the figures; None if it failed.
        differences: of the rollouts.
        tracks: of the entities that deviate; of the first scenarios only.
        explanation: the differences in words.
        robustness: share of its neighbours that are harmful here, from the run's triage; None
            if they were not tested.
    """

    evaluation: Whole
    name: str | None
    row: str
    here: Outcome
    there: Outcome | None = None
    failure: str = ""
    change: Change | None = None
    differences: Differences | None = None
    tracks: tuple[Course, ...] = ()
    explanation: str = ""
    robustness: Annotated[float, Field(ge=0.0, le=1.0)] | None = None

    @property
    def knife_edge(self) -> bool:
        """Whether fewer than half of its neighbours are harmful, so that a miss is likely."""
        return self.robustness is not None and self.robustness < 0.5

    @model_validator(mode="after")
    def _whole(self) -> "Scenario":
        if len({outcome is None for outcome in (self.there, self.change, self.differences)}) > 1:
            raise ValueError("there, change and differences must be together")
        return self

    @property
    def confirmed(self) -> bool | None:
        """Whether it is critical there, too; None if it did not run there."""
        return None if self.there is None else self.there.critical


class Record(_Model):
    """A run's confirmation in one other simulator.

    Attributes:
        simulator: its name.
        label: the same with its version.
        settings: of the simulator.
        reference: the run's own simulator.
        run: the run's folder.
        scenario: the logical scenario.
        ego: the driver.
        thresholds: when a scenario is critical by the rule "thresholds".
        rule: what makes a scenario critical, "harm", "thresholds" or "criteria".
        count: whose conflicts are harm, "ego" or "any".
        objectives: the names of F's columns.
        parted_at: see `differences.DIVERGED`.
        trace: see `differences.TRACE`.
        scale: see SCALE.
        scenarios: most critical first.
    """

    simulator: str
    label: str
    settings: dict[str, bool | int | float | str]
    reference: str
    run: str
    scenario: str
    ego: str
    thresholds: Thresholds
    rule: Rule = "thresholds"
    count: Count = "ego"
    objectives: tuple[str, ...]
    parted_at: Number = DIVERGED
    trace: Number = TRACE
    scale: dict[str, int] = SCALE
    scenarios: tuple[Scenario, ...] = ()


def number(value: float) -> float | None:
    """Return a number for JSON; None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def _minus(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else a - b


def _units(values: Float) -> tuple[int | None, ...]:
    return tuple(int(item) if math.isfinite(item) else None for item in np.round(values).tolist())


PREFIX, SUFFIX = "confirmation-", ".json"


def file_name(simulator: str) -> str:
    """Return the name of a simulator's record in a run's folder."""
    return f"{PREFIX}{simulator}{SUFFIX}"


def digest_of(x: Float, metrics: Float) -> str:
    """Return the digest of an evaluation's parameters and metrics, which identifies it."""
    digest = sha256()
    for array in (x, metrics):
        digest.update(array.astype("<f8").tobytes())
    # 64 bits identify a row among those of one run.
    return digest.hexdigest()[:16]


def write_record(folder: Path, record: Record) -> Path:
    """Write a record into a run's folder atomically; return its path.

    Raises:
        StorageError: it cannot be written.
    """
    path = folder / file_name(record.simulator)
    write_whole(path, [record.model_dump_json(indent=1).encode(), b"\n"])
    return path


def read_record(path: Path) -> Record | None:
    """Return a record of `write_record`; None if the file does not exist.

    Raises:
        FileFormatError: the file is not such a record.
        StorageError: it cannot be read.
    """
    record = read_model(path, Record, _not_ours)
    if record is not None and file_name(record.simulator) != path.name:
        raise _not_ours(path, f"simulator is {record.simulator[:40]!r}")
    return record


def _not_ours(path: Path, why: str) -> FileFormatError:
    return FileFormatError(
        f"{path}: must be what 'bridgegen confirm' writes, and is not: {why}; "
        "run that with --again, or delete the file"
    )


def read_records(folder: Path, X: Numbers, metrics: Numbers) -> tuple[Record, ...]:
    """Return the records of all simulators in a run's folder, by their names.

    Args:
        folder: of the run.
        X: ``(N, n)`` of the run.
        metrics: ``(N, M)`` of the run.

    Raises:
        FileFormatError: a file is not such a record, or belongs to another run.
        StorageError: one cannot be read.
    """
    records = []
    for path in sorted(folder.glob(f"{PREFIX}*{SUFFIX}")):
        record = read_record(path)
        if record is not None:
            check_rows(path, record.scenarios, X, metrics)
            records.append(record)
    return tuple(records)


def check_rows(path: Path, scenarios: Iterable[Scenario], X: Numbers, metrics: Numbers) -> None:
    """Check that a record belongs to these evaluations.

    Args:
        path: of the record, for the message.
        scenarios: of the record.
        X: see ``read_records``.
        metrics: see ``read_records``.

    Raises:
        FileFormatError: it belongs to another run.
    """
    for scenario in scenarios:
        k = scenario.evaluation
        if k >= len(X) or scenario.row != digest_of(X[k], metrics[k]):
            raise FileFormatError(
                f"{path}: is of another run: evaluation {k + 1} is not the one that was "
                "confirmed; confirm it with --again, or delete the file"
            )
