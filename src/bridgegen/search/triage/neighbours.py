"""The neighbours of a row: is its harm robust, and which fix removes it significantly?

Each searched parameter of a neighbour lies within ±2.5 % of its range around the row's. All
neighbours of a row, with and without a fix, use the random numbers of that row: the noise of the
driver's sensors follows from a key, a hash of parameter values, and the row's values are hashed for
all of them (`bridgegen.drivers.noise`). So a neighbour differs from the row only in its parameters,
and a fix changes only the stage that it idealises.
"""

from collections.abc import Sequence

import numpy as np

from bridgegen.assess.cause import Cause, Counterfactual
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.statistics import paired_drop, wilson
from bridgegen.engine.pipeline import Pipeline
from bridgegen.search.triage.moves import around
from bridgegen.search.triage.record import Neighbourhood, Treatment

# The same number with every effort: fewer would give "robust" another meaning from run to run.
NEIGHBOURS = 32
RADIUS = 0.025
"""Maximum move of each searched parameter, a share of its range."""

ROBUST = 0.5
"""Share of harmful neighbours below which a finding is knife-edge."""

PLACEBO = "random move"
UNKNOWN = "not known"
"""The cause where too few neighbours have a result with some fix."""

_AS_IS, _MOVED = -1, -2

ENOUGH = NEIGHBOURS // 2
"""Number of neighbours that must have a result with each fix to say that no fix helps."""

AsIs = dict[int, tuple[Bool, Bool, Float]]
"""Results of unchanged neighbours, by evaluation: which are harmful, which have a result, and up to
when each is known to be harmless [s]."""


def neighbourhoods(
    pipeline: Pipeline,
    X: Float,
    evaluations: Int,
    seed: int,
    *,
    fixes: bool = True,
    sampled: bool = False,
    as_is: AsIs | None = None,
) -> list[Neighbourhood]:
    """Simulate the neighbours of rows in one batch; a row's result depends on that row alone.

    Args:
        pipeline: the run's, one that ``tries``.
        X: ``(K, len(space.names))``, the rows.
        evaluations: ``(K,)`` their ids in the store.
        seed: of the run.
        fixes: whether to simulate them with every fix and the placebo, too.
        sampled: whether the rows were drawn at random.
        as_is: known results of unchanged neighbours; new ones are added.
    """
    known: AsIs = {} if as_is is None else as_is
    ids = evaluations.tolist()
    new = np.array([k for k, item in enumerate(ids) if item not in known], dtype=np.int64)
    harmful, ok, until = _simulate(pipeline, X[new], evaluations[new], seed, [_AS_IS])
    known |= {
        ids[k]: (harmful[j, :, 0], ok[j, :, 0], until[j, :, 0]) for j, k in enumerate(new.tolist())
    }
    tried = pipeline.runner.fixes if fixes else ()
    variants = [_MOVED, *range(len(tried))] if tried else []
    harmful, ok, until = _simulate(pipeline, X, evaluations, seed, variants)
    made = []
    for k, item in enumerate(ids):
        before, has, when = known[item]
        # With the conflict, what followed is gone: harmless up to its time is enough.
        ok[k] |= (before & has)[:, np.newaxis] & (until[k] >= when[:, np.newaxis])
        made.append(
            _neighbourhood(
                item,
                np.concatenate([before[:, np.newaxis], harmful[k]], axis=1),
                np.concatenate([has[:, np.newaxis], ok[k]], axis=1),
                tried,
                sampled,
            )
        )
    return made


def _simulate(
    pipeline: Pipeline, X: Float, evaluations: Int, seed: int, variants: Sequence[int]
) -> tuple[Bool, Bool, Float]:
    """Return which neighbours are harmful, have a result, and up to when each is harmless.

    All are ``(K, NEIGHBOURS, variants)``; see ``Trials.harmless_until``.
    """
    space, shape = pipeline.space, (len(X), NEIGHBOURS, len(variants))
    if not len(X) or not variants:
        return np.zeros(shape, np.bool_), np.zeros(shape, np.bool_), np.zeros(shape)
    near = np.array(
        [
            around(space, x, seed, i, NEIGHBOURS, RADIUS)
            for x, i in zip(X, evaluations.tolist(), strict=True)
        ]
    )  # (K, 2, NEIGHBOURS, n)
    # Noise is that of the finding's row, so that a neighbour differs in its parameters alone.
    # Neighbour by neighbour, so that those of one road network are simulated by one worker.
    rows = np.stack([near[:, int(variant == _MOVED)] for variant in variants], axis=2)
    noise = np.broadcast_to(X[:, np.newaxis, np.newaxis], rows.shape)
    fix = np.broadcast_to(np.maximum(variants, _AS_IS), shape)
    n = len(space.names)
    trials = pipeline.try_all(rows.reshape(-1, n), fix.reshape(-1), noise.reshape(-1, n))
    return (
        trials.harmful.reshape(shape),
        trials.ok.reshape(shape),
        trials.harmless_until.reshape(shape),
    )


def _neighbourhood(
    evaluation: int, harmful: Bool, ok: Bool, fixes: Sequence[Counterfactual], sampled: bool
) -> Neighbourhood:
    """Summarise neighbours; ``harmful`` and ``ok`` are ``(NEIGHBOURS, variants)``."""
    rows, hits = int(ok[:, 0].sum()), int(harmful[:, 0].sum())
    low, high = wilson(hits, rows)
    placebo, treatments = None, []
    if fixes:
        # A random move removes some harm, too: a fix must remove significantly more than that.
        placebo = treatment(PLACEBO, "", harmful[:, [0, 1]], ok[:, [0, 1]])
        for k, fix in enumerate(fixes, start=2):
            pair = [0, k]
            treatments.append(
                treatment(fix_name(fix), fix.cause.label, harmful[:, pair], ok[:, pair])
            )
    return Neighbourhood(
        evaluation=evaluation,
        rows=rows,
        harmful=hits,
        robustness=hits / rows if rows else None,
        low=low,
        high=high,
        cause=cause_of(hits, rows, treatments, placebo),
        fixes=tuple(treatments),
        placebo=placebo,
        sampled=sampled,
    )


def treatment(name: str, cause: str, harmful: Bool, ok: Bool) -> Treatment:
    """Return what a change made of neighbours.

    Args:
        name: of the change.
        cause: that it stands for.
        harmful: ``(n, 2)`` bool, unchanged and with the change.
        ok: ``(n, 2)`` bool, which have a result; only neighbours with both count.
    """
    known = ok.all(axis=1)
    before, after = harmful[known].T
    gone, new = int((before & ~after).sum()), int((~before & after).sum())
    both, n = int((before & after).sum()), int(known.sum())
    drop, low, high = paired_drop(both, gone, new, n - both - gone - new)
    return Treatment(
        name=name,
        cause=cause,
        rows=n,
        gone=gone,
        new=new,
        drop=drop,
        low=low,
        high=high,
        before=both + gone,
    )


def cause_of(harmful: int, rows: int, fixes: Sequence[Treatment], placebo: Treatment | None) -> str:
    """Return the cause of a row's harm, by its neighbours; see `Neighbourhood.cause`."""
    if placebo is None or not rows:
        return ""
    if harmful < ROBUST * rows:
        return "sensitive"
    for fix in fixes:
        if fix.works and fix.exceeds(placebo):
            return fix.cause
    if any(fix.rows < ENOUGH for fix in fixes):
        return UNKNOWN
    return Cause.UNAVOIDABLE.label


def fix_name(fix: Counterfactual) -> str:
    """Return what a fix does, in words."""
    if fix.cause is Cause.PERCEPTION:
        return "perception is ideal"
    if fix.cause is Cause.PLANNING:
        return f"{fix.driver.name} drives"
    if fix.cause is Cause.VEHICLE_DYNAMICS:
        return "the vehicle is kinematic"
    return "the road is dry" if fix.dry else "control is ideal"
