"""What judging and measuring a row by itself needs besides its record."""

from dataclasses import astuple
from typing import Any

import numpy as np

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict._judge_kernels import Facts, Verdict
from bridgegen.assess.conflict._measure_kernels import Measuring
from bridgegen.assess.conflict._violation_kernels import LEAVINGS, PASSINGS
from bridgegen.assess.conflict.plausibility import AFTER, limits_of, towed_by_of, window_of
from bridgegen.assess.metrics import braking, distances, impact, perception, road, times
from bridgegen.assess.metrics.metric import in_steps
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRIP, HARD_BRAKING
from bridgegen.simulation.rollout import Rollout


def facts_of(rollout: Rollout, row: int, corridor: Float) -> Facts:
    """Return what judging a row needs besides its record.

    Args:
        rollout: of rows of the same storyboard.
        row: one on the same road network.
        corridor: of the ego's first path there; see `Facts`.
    """
    e = rollout.shape[1]
    stops = rollout.stop_entities.size
    return Facts(
        box=rollout.box,
        half=0.5 * rollout.box[:, :2],
        kinds=np.ascontiguousarray(rollout.kinds, dtype=np.int64),
        claims=rollout.claims[row] if rollout.claims.size else np.zeros((e, e), np.int64),
        crosswalks=rollout.crosswalks[row] if rollout.crosswalks.size else np.zeros((0, 5)),
        stop_entities=np.ascontiguousarray(rollout.stop_entities, dtype=np.int64),
        stop_lights=np.ascontiguousarray(rollout.stop_lights, dtype=np.int64),
        stop_lines=rollout.stop_lines[row] if stops else np.zeros((0, 3)),
        corridor=corridor,
        time_step=rollout.time_step,
        after=round(AFTER / rollout.time_step),
        own_bodies=sum(rollout.is_ego_s(entity) for entity in range(e)),
    )


def measuring_of(rollout: Rollout, row: int) -> Measuring:
    """Return what measuring a row needs besides; see `facts_of`."""
    own, dt = np.flatnonzero(rollout.stop_entities == 0), rollout.time_step
    classes = perception.CLASS_OF_KIND[rollout.kinds]
    return Measuring(
        limits=limits_of(rollout),
        towed_by=np.ascontiguousarray(towed_by_of(rollout), dtype=np.int64),
        window=window_of(rollout),
        merged=in_steps("MERGED", impact.MERGED, dt),
        abrupt=in_steps("ABRUPT", braking.ABRUPT, dt),
        longest=in_steps("LONGEST", times.LONGEST, dt),
        hard=HARD_BRAKING,
        most=braking.MOST,
        grip=GRIP,
        target=times.TARGET,
        beside=road.ASIDE,
        safe=np.array(astuple(distances.Parameters())),
        lines=rollout.stop_lines[row, own] if own.size else np.zeros((0, 3)),
        line_lights=np.ascontiguousarray(rollout.stop_lights[own], dtype=np.int64),
        classes=classes,
        reach=perception.RANGES[classes],
        class_of_kind=perception.CLASS_OF_KIND,
        ranges=perception.RANGES,
        thresholds=perception.THRESHOLDS,
    )


def verdict_of(e: int, t: int) -> Verdict:
    """Return room for the verdict on a row of E entities and T instants."""
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(Verdict._fields, (e, t))
    shapes |= dict.fromkeys(("potential", "severity", "aside", "breach", "at_fault"), (e,))
    shapes |= {"whole": (e, codes.INTEGERS), "real": (e, codes.FLOATS), "changes": (e, 2)}
    shapes |= {"is_judged": (1,), "least": (1,), "over": (1,), "instants": (2,), "gaps": (2,)}
    shapes |= {"until": (1,)}
    shapes |= {"apart": (2, t), "leave": (LEAVINGS,), "passed": (PASSINGS,)}
    kinds: dict[str, Any] = dict.fromkeys(
        ("whole", "instants", "until", "leave", "passed"), np.int64
    )
    kinds |= dict.fromkeys(("is_judged", "at_fault", "reverses"), np.bool_)
    return Verdict(**{n: np.zeros(shape, kinds.get(n, float)) for n, shape in shapes.items()})
