"""How verdicts depend on constants of the models: elementary effects, and one constant at a time.

``sensitivity.json`` in a run's folder is written from these models, and checked by them.

Source: Morris, Technometrics 33 (1991) 161-174; the mean of absolute effects, mu*: Campolongo,
Cariboni and Saltelli, Environmental Modelling & Software 22 (2007) 1509-1518.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bridgegen.base.arrays import Float, Int
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model
from bridgegen.engine.constants import Constant

JSON_FILE = "sensitivity.json"
"""File of the record in a run's folder."""

LEVELS = 4
"""Levels of each factor, from 0 to 1; Morris's choice, with `STEP` visits all equally often."""

STEP = LEVELS / (2.0 * (LEVELS - 1.0))
"""Size of a step [1]: two thirds of a factor's range."""

HALVINGS = 6
"""Number of times that the part of a range in which a verdict changes is halved: to 1/256 of the
distance between the nominal value and the range's end, for there are `BETWEEN` values before it."""

BETWEEN = (0.25, 0.5, 0.75, 1.0)
"""Where a constant is tried on its way from the nominal value to an end of its range."""

Name = Annotated[str, Field(max_length=200)]
Text = Annotated[str, Field(max_length=2000)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=10**8)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Effect(_Model):
    """What one factor makes of one finding.

    Attributes:
        name: of a constant, or of a parameter of the scenario.
        kind: which of them.
        mu_star: mean of the absolute elementary effects on harm, per whole range of the factor.
        sigma: their standard deviation: of a factor that acts alone and linearly 0.
        flips: trajectories in which the verdict changes as this factor takes its step.
        of: trajectories in which both ends of the step have a result.
        at_least: the least value of the constant, alone, with which the finding stands, where its
            verdict changes below; None where it does not within the plausible range.
        at_most: likewise the greatest.
    """

    name: Name
    kind: Literal["constant", "parameter"]
    mu_star: Annotated[float, Field(ge=0.0)]
    sigma: Annotated[float, Field(ge=0.0)]
    flips: Count
    of: Count
    at_least: Number | None = None
    at_most: Number | None = None


class Finding(_Model):
    """How the verdict on an evaluation depends on factors.

    Attributes:
        evaluation: its id in the store.
        title: what it is, in words.
        conflict: its kind.
        harm: at the nominal constants.
        effects: those of the largest share of flips first.
        sentences: of constants that its verdict hangs on alone.
    """

    evaluation: Count
    title: Text
    conflict: Name
    harm: Annotated[float, Field(ge=0.0, le=1.0)]
    effects: Annotated[tuple[Effect, ...], Field(max_length=1000)]
    sentences: Annotated[tuple[Text, ...], Field(max_length=100)]


class Sensitivity(_Model):
    """The record of a run.

    Attributes:
        version: of this format.
        scenario: its name.
        ego: the driver.
        results: digest of the run's evaluations, to which this belongs.
        seed: of the trajectories.
        trajectories: of Morris's design.
        radius: by which share of its range a parameter moves to either side.
        evaluations: simulated in all.
        constants: those that were varied.
        not_varied: others, and why not.
        findings: the run's, as far as the budget allowed.
        left_out: how many findings were not analysed, for the budget, or as their verdict is not
            reproduced.
    """

    version: Literal[1] = 1
    scenario: Name
    ego: Name
    results: Name
    seed: Count
    trajectories: Count
    radius: Number
    evaluations: Count
    constants: Annotated[tuple[Constant, ...], Field(max_length=100)]
    not_varied: Annotated[dict[Text, Text], Field(max_length=100)]
    findings: Annotated[tuple[Finding, ...], Field(max_length=1000)]
    left_out: Count


def write_record(path: Path, record: Sensitivity) -> None:
    """Write a record, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    write_whole(path, [record.model_dump_json(indent=2).encode() + b"\n"])


def read_record(path: Path, results: str) -> Sensitivity | None:
    """Return a record; None if the file does not exist.

    Args:
        path: of the file.
        results: digest of the run's evaluations.

    Raises:
        FileFormatError: it is no such record, or of other evaluations.
        StorageError: it cannot be read.
    """
    record = read_model(path, Sensitivity, _not_ours)
    if record is not None and record.results != results:
        raise _not_ours(path, "it belongs to other evaluations")
    return record


def _not_ours(path: Path, reason: str) -> FileFormatError:
    return FileFormatError(f"{path}: not a record of sensitivity: {reason}")


def design(trajectories: int, factors: int, seed: int) -> tuple[Float, Int]:
    """Return Morris's trajectories: each changes one factor after the other, by `STEP`.

    Args:
        trajectories: r.
        factors: k.
        seed: of the random numbers.

    Returns:
        Points ``(r, k + 1, k)`` in [0, 1], and the factor of each step ``(r, k)``.
    """
    random = np.random.Generator(np.random.PCG64([seed, 23]))
    points, order = np.empty((trajectories, factors + 1, factors)), []
    for number in range(trajectories):
        below = random.integers(0, LEVELS // 2, factors) / (LEVELS - 1.0)
        up = random.random(factors) < 0.5
        moved = random.permutation(factors)
        point = np.where(up, below, below + STEP)
        points[number, 0] = point
        for step, factor in enumerate(moved, 1):
            point[factor] += STEP if up[factor] else -STEP
            points[number, step] = point
        order.append(moved)
    return points, np.array(order, np.int64).reshape(trajectories, factors)


def elementary_effects(points: Float, order: Int, y: Float) -> Float:
    """Return the effect of each factor in each trajectory, ``(r, k)``, per whole range.

    Args:
        points: see `design`; so is ``order``.
        order: the factor of each step.
        y: ``(r, k + 1)``, the output; NaN where there is none.
    """
    found = np.empty(order.shape)
    for number, factors in enumerate(order):
        steps = np.arange(len(factors))
        moved = points[number, steps + 1, factors] - points[number, steps, factors]
        found[number, factors] = np.diff(y[number]) / moved
    return found


def summary(effects: Float) -> tuple[Float, Float]:
    """Return mu* and sigma of each factor, ``(k,)``; 0 of one without effects.

    Args:
        effects: ``(r, k)``; NaN where one is not known.
    """
    known = np.isfinite(effects)
    n = known.sum(axis=0)
    values = np.where(known, effects, 0.0)
    mean = values.sum(axis=0) / np.maximum(n, 1)
    mu_star = np.abs(values).sum(axis=0) / np.maximum(n, 1)
    square = np.where(known, (values - mean) ** 2, 0.0).sum(axis=0)
    return mu_star, np.sqrt(square / np.maximum(n - 1, 1))


def limit(
    nominal: float, tried: Sequence[tuple[float, bool]], stands: Callable[[float], bool]
) -> float | None:
    """Return how far a constant may go until a verdict changes; None: through its range.

    Args:
        nominal: its value, where the verdict stands.
        tried: values away from it, in order, and whether the verdict stands there.
        stands: tries another.
    """
    inside = nominal
    for value, is_same in tried:
        if is_same:
            inside = value
            continue
        outside = value
        for _ in range(HALVINGS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if stands(middle) else (inside, middle)
        return inside
    return None


def sentence(words: str, unit: str, at_least: float | None, at_most: float | None) -> str:
    """Return what a finding hangs on; "" if it does not."""
    unit = {"1": "", "×": " times its nominal value"}.get(unit, f" {unit}")
    if at_least is not None and at_most is not None:
        return f"stands only while {words} is between {at_least:.4g} and {at_most:.4g}{unit}"
    if at_most is not None:
        return f"stands only while {words} is ≤ {at_most:.4g}{unit}"
    return f"stands only while {words} is ≥ {at_least:.4g}{unit}" if at_least is not None else ""
