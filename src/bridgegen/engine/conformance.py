"""Whether this machine gives the published bits: digests of functions, motions and metrics."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from importlib.resources import files

import numpy as np

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.harm import harm_of_pairs
from bridgegen.base import elementary
from bridgegen.base._elementary_kernels import FUNCTIONS
from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.scenario.language.reader import load, names

DRIVERS = ("route-follower", "reference", "careful", "un-r157")
"""Drivers whose rows have a published digest, in each scenario of the catalogue."""

SHIPPED = (*DRIVERS, "fsm", "careful-fsm")
"""Drivers whose verdicts have one."""

ROWS, BLOCK = 10_000, 500
"""Number of rows of a digest, and of those that are held at once."""

SAMPLE = 60
"""Number of rows of a digest with verdicts, of which each driver that ships has one."""

QUICK = ("crossroads-s4", "route-follower")
"""Scenario and driver whose rows `differences` compares: a second, once they are compiled."""


def function_digests() -> dict[str, str]:
    """Return the digest of each elementary function at 10,000 arguments."""
    rng = np.random.default_rng(0)
    # Not `10.0 **`: NumPy's powers have other last bits with AVX-512.
    sizes = np.array([float(f"1e{k}") for k in range(-8, 9)])
    x, y = rng.normal(size=(2, ROWS)) * sizes[rng.integers(-8, 9, size=(2, ROWS)) + 8]
    return {name: _digest([getattr(elementary, name)(x, y)]) for name in FUNCTIONS}


def rows_digest(scenario: str, driver: str, rows: int = ROWS, *, verdicts: bool = False) -> str:
    """Return the digest of the motion and the metrics of random rows of a scenario.

    Args:
        scenario: of the catalogue, or a path.
        driver: the ego's.
        rows: how many are drawn; those that the scenario's rules refuse do not count.
        verdicts: include all that is said of conflicts.

    Raises:
        InputError: no such scenario or driver, or the driver does not drive there.
    """
    logical = load(scenario)
    space = logical.space()
    pipeline = Pipeline(logical, space, PipelineOptions(ego=driver), workers=Threads(1))
    X = space.decode(np.random.default_rng(0).random((rows, space.n_var)))
    X = X[np.isfinite(X).all(axis=1)]

    def arrays() -> Iterator[np.ndarray]:
        for first in range(0, len(X), BLOCK):
            rollout = pipeline.runner.run(X[first : first + BLOCK])
            yield from (rollout.x, rollout.y, rollout.h, rollout.v, rollout.a)
            yield from (rollout.n_steps, rollout.status, pipeline.measure(rollout))
            if verdicts:
                found = analyse(rollout)
                yield from (found.kind, found.type, found.responsible, found.rule)
                yield from (found.instant, found.decided, found.preventable, found.at_fault)
                yield from (found.severity, harm_of_pairs(found))

    return _digest(arrays())


def verdict_digests(drivers: Iterable[str] = SHIPPED) -> dict[str, str]:
    """Return the digests of `SAMPLE` rows with verdicts, by scenario of the catalogue and driver.

    "" where the driver does not drive.
    """
    found = {}
    for driver in drivers:
        for scenario in names():
            try:
                digest = rows_digest(scenario, driver, SAMPLE, verdicts=True)
            except InputError:
                digest = ""
            found[f"{scenario} {driver}"] = digest
    return found


def published() -> dict[str, dict[str, str]]:
    """Return the published digests.

    "functions" by name; "rows" and, of `SAMPLE` rows, "verdicts" by scenario and driver.
    """
    text = (files("bridgegen.engine") / "conformance.json").read_text("utf-8")
    found: dict[str, dict[str, str]] = json.loads(text)
    return found


def differences(*, rows: bool = True) -> list[str]:
    """Return what gives other bits here than the published ones: functions, then rows.

    Args:
        rows: compare rows, too, which compiles if no search has.
    """
    want, got = published(), function_digests()
    found = [name for name in FUNCTIONS if got[name] != want["functions"][name]]
    if rows and rows_digest(*QUICK) != want["rows"][" ".join(QUICK)]:
        found.append(f"motion or metrics of {QUICK[0]} with {QUICK[1]}")
    return found


def _digest(arrays: Iterable[np.ndarray]) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        if array.dtype == np.float64:
            array = np.where(np.isnan(array), np.nan, array)  # a NaN has many bits
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]
