"""All metrics by name.

A new one: a function and its ``Metric`` in the file of its family, and one entry here. Or a
package's: an entry point of the group ``bridgegen.assess.metrics``.
"""

import hashlib
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bridgegen.assess.metrics.braking import A_CHANGE, BTN, DRAC, N_BRAKE
from bridgegen.assess.metrics.distances import D_MIN, RSS, V_D
from bridgegen.assess.metrics.impact import (
    IMPACT_SPEED,
    N_COLLISION,
    RELATIVE_IMPACT_SPEED,
    SPEED_REDUCTION,
)
from bridgegen.assess.metrics.metric import Metric, Need
from bridgegen.assess.metrics.perception import E_POSITION, IOU, MEAN_AVERAGE_PRECISION
from bridgegen.assess.metrics.road import L_OFFSET, R_RED
from bridgegen.assess.metrics.times import PET, TET, THW, TIT, TTC
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.plugins import PlugIns, Registry, file_of, is_own, object_of
from bridgegen.drivers import DRIVERS, Driver
from bridgegen.simulation.rollout import Rollout

_TABLE_I = (
    R_RED,
    N_COLLISION,
    TTC,
    D_MIN,
    V_D,
    L_OFFSET,
    IOU,
    E_POSITION,
    MEAN_AVERAGE_PRECISION,
    A_CHANGE,
    N_BRAKE,
)

_BEYOND = (
    PET,
    DRAC,
    BTN,
    THW,
    TET,
    TIT,
    RSS,
    IMPACT_SPEED,
    RELATIVE_IMPACT_SPEED,
    SPEED_REDUCTION,
)

_OURS: dict[str, Metric] = {metric.name: metric for metric in (*_TABLE_I, *_BEYOND)}

ADDED = PlugIns("metric", "bridgegen.metrics")


def _checked(found: object, name: str) -> Metric:
    """Return a package's metric, with checks of its results.

    Raises:
        InputError: it is not a metric of that name.
    """
    if not isinstance(found, Metric):
        raise InputError(
            f"{ADDED.place(name)} must be a bridgegen.assess.metrics.Metric, got "
            f"{type(found).__name__}"
        )
    if found.name != name:
        raise InputError(
            f"{ADDED.place(name)} has the name '{found.name}'; the two names must agree"
        )
    return _with_checks(found, ADDED.place(name))


def _with_checks(found: Metric, place: str) -> Metric:
    """Return another's metric whose results are checked."""

    def compute(rollout: Rollout) -> Float:
        try:
            values = np.asarray(found.compute(rollout), dtype=np.float64)
        except Exception as error:
            raise InputError(f"{place} fails: {type(error).__name__}: {error}") from error
        n, failed = rollout.shape[0], np.asarray(rollout.status) != 0
        if values.shape != (n,):
            raise InputError(
                f"{place} must return {n} numbers, one for each scenario, got an array "
                f"of the shape {values.shape}"
            )
        # NaN means a failed row to every reader: one that is missing, or one too many, would pass
        # for it.
        if bad := np.flatnonzero(np.isnan(values) != failed).size:
            raise InputError(
                f"{place} must be NaN exactly where a scenario failed; it is otherwise "
                f"in {bad} of {n}"
            )
        return values

    return replace(found, compute=compute)


METRICS: Mapping[str, Metric] = Registry(_OURS, ADDED, _checked)
"""Metrics by name: those of the paper's Table I, then ours beyond it, then those of installed
packages."""

OF_BASELINE = "baseline:"
"""Prefix of the name of a quantity of the same scenario with the baseline's driver."""

_NAMED: set[str] = set()
"""Names of the metrics that were read from files and modules of the user."""


def read(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of metrics; those of the user's own are imported, and known from then on.

    Args:
        names: of metrics; or where one of the user's own is, ``file.py:METRIC`` or
            ``module:METRIC``. Only what a person has typed may be given, never what a folder says.

    Raises:
        InputError: one cannot be imported, is no metric, or has the name of another one.
    """
    found: dict[str, str] = {}
    for name in names:
        if not is_own(name) or name.startswith(OF_BASELINE):
            found.setdefault(name, name)
            continue
        metric = object_of(name, "--metrics", Metric, "Metric")
        if metric.name in found or (metric.name in METRICS and metric.name not in _NAMED):
            raise InputError(
                f"the metric '{name}' has the name '{metric.name}', which another one has"
            )
        _NAMED.add(metric.name)
        _OURS[metric.name] = _with_checks(metric, f"metric '{name}'")
        found[metric.name] = name
    return tuple(found)


def about(spec: str) -> dict[str, str | float]:
    """Return what a run records of a metric of the user's own, which was read, but its code."""
    (name,) = read([spec])
    path, metric = file_of(spec), METRICS[name]
    digest = hashlib.sha256(path.read_bytes()).hexdigest() if path else ""
    facts = ("name", "unit", "description", "sense", "cap")
    return {"code": spec, "sha256": digest} | {fact: getattr(metric, fact) for fact in facts}


def stand_in(about: Mapping[str, Any]) -> None:
    """Make a recorded metric of somebody's own known without its code, so that it cannot compute.

    Raises:
        ValueError: what was recorded of it is damaged.
    """
    name, code = about.get("name"), about.get("code")

    def compute(rollout: Rollout) -> Float:
        raise InputError(
            f"the metric '{name}' is code ({code}), which this command does not import; a package "
            "that declares it as an entry point is"
        )

    facts = {fact: about.get(fact) for fact in ("name", "unit", "description")}
    if not all(isinstance(fact, str) for fact in facts.values()):
        raise ValueError("name, unit and description of an own metric must be texts")
    if name not in METRICS:
        cap = float(about.get("cap", math.nan))
        _OURS[str(name)] = Metric(**facts, sense=about.get("sense"), cap=cap, compute=compute)  # type: ignore[arg-type]
        _NAMED.add(str(name))


TABLE_I = tuple(metric.name for metric in _TABLE_I)
"""Names of the paper's eleven metrics, which every run records as far as its rollouts allow."""


def get(name: str) -> Metric:
    """Return the metric of that name.

    Raises:
        UnknownNameError: there is none; the message suggests the nearest.
        InputError: an installed package's that cannot be loaded.
    """
    if name not in METRICS:
        raise UnknownNameError("metric", name, METRICS)
    return METRICS[name]


def evaluate(rollout: Rollout, names: Sequence[str]) -> Float:
    """Return the named metrics of every scenario.

    Returns:
        ``(N, M)`` float64, a column per name, in the metric's unit; NaN throughout a row exactly
        where the scenario failed (the reason is in ``rollout.status``).

    Raises:
        UnknownNameError: a name is not a metric's.
        ValueError: the rollout does not hold what a metric needs, or what it holds is malformed.
    """
    metrics = [get(name) for name in names]
    out = np.empty((rollout.shape[0], len(metrics)))
    for j, metric in enumerate(metrics):
        out[:, j] = metric.compute(rollout)
    return out


# --- Which metrics exist: for example no mean IoU with a driver that does not perceive ---


def held_by(driver: Driver, *, detects: bool = False) -> tuple[Need, ...]:
    """Return what a simulator's rollouts of a driver hold besides motion.

    Args:
        driver: of the ego.
        detects: whether a detector records detections, whatever the driver.
    """
    perceives = detects or driver.perceives
    return ("detections", "lights", "offset") if perceives else ("lights", "offset")


def existing(names: Sequence[str], held: Collection[Need]) -> tuple[str, ...]:
    """Return those of the named metrics that exist where rollouts hold ``held``.

    Raises:
        UnknownNameError: a name is not a metric's.
    """
    return tuple(name for name in names if get(name).needs in (None, *held))


def require(names: Sequence[str], held: Collection[Need], source: str) -> tuple[str, ...]:
    """Return the names, all of which must exist where rollouts hold ``held``.

    Args:
        names: of metrics.
        held: what the rollouts hold.
        source: of the rollouts, for the message.

    Raises:
        UnknownNameError: a name is not a metric's.
        InputError: those that do not exist there, all at once.
    """
    perceive = ", ".join(driver.name for driver in DRIVERS.values() if driver.perceives)
    hints = {"detections": f"; drivers that perceive (--ego): {perceive}" if perceive else ""}
    needs = {name: get(name).needs for name in names}
    problems = [
        f"the metric '{name}' needs {need}, and {source} has none{hints.get(need, '')}"
        for name, need in needs.items()
        if need is not None and need not in held
    ]
    if problems:
        raise InputError(*problems)
    return tuple(names)


def to_record(driver: Driver, asked: Sequence[str], *, detects: bool = False) -> tuple[str, ...]:
    """Return what a search records: Table I's metrics, as far as they exist, and requested ones.

    Others are recorded only on request: together they take longer than the paper's.

    Raises:
        UnknownNameError: a name is not a metric's.
        InputError: a requested one does not exist with this driver.
    """
    held = held_by(driver, detects=detects)
    chosen = require(asked, held, f"the driver '{driver.name}'")
    return tuple(dict.fromkeys((*existing(TABLE_I, held), *chosen)))
