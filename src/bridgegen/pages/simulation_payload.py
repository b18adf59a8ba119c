"""What a report simulates scenarios with: kernels, a storyboard's tables, the parameters' rules."""

from functools import cache
from typing import Any

import numpy as np

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict import harm, quantities
from bridgegen.assess.conflict._limits import HORIZON, SERIOUS_DECELERATION
from bridgegen.assess.conflict._measure_kernels import IOU, MEASURED
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.judging import facts_of, measuring_of, verdict_of
from bridgegen.assess.conflict.plausibility import Implausible
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule, Zone
from bridgegen.assess.metrics import OF_BASELINE
from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.packed import deflated
from bridgegen.pages.storyboard_payload import storyboard_payload
from bridgegen.scenario.countries import in_the_mirror
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.adversary import AdversarySource
from bridgegen.simulation.embedded import portable

TRIED = 64
"""Number of random rows that are run first, so that the ways are planned that rows may need."""

FILES = 3
"""Number of rows whose scenario files are made, to see that they differ in values alone."""

MOST = 450_000
"""Maximum number of characters of the tables: those of the catalogue take 16,000 to 400,000."""

COLUMNS = (
    *("KIND", "TYPE", "RESPONSIBLE", "RULE", "INSTANT", "DECIDED", "ZONE_EGO", "ZONE_OTHER"),
    *("TTC", "NEEDED", "NEARNESS"),
)
"""Columns of a verdict's numbers that the page reads."""

OF_CONFLICT = {"severity": ["severity", 1], "delta_v": ["changes", 2]}
"""Metrics that a verdict has of each conflict: its field, and how many numbers that has of each."""

HARM = {
    "course": harm.COURSE,
    "near": harm.NEAR_MISS,
    "light": harm.LIGHT,
    "nearly": harm.NEARLY,
    "violates": harm.VIOLATES,
    "horizon": HORIZON,
    "serious": SERIOUS_DECELERATION,
}
"""What the page tells by which conflict decides; see `harm`."""


def simulation_payload(pipeline: Pipeline, commands: tuple[str, str] = ("", "")) -> dict[str, Any]:
    """Return what ``simulator.js`` and ``explore.js`` need; or only "refused", why they cannot.

    Args:
        pipeline: of the scenario.
        commands: the command line that simulates a row with the driver, and with none named yet;
            values follow.
    """
    try:
        _refuse_what_is_not_portable(pipeline)
        space, runner = pipeline.space, pipeline.runner
        X = space.decode(np.random.default_rng(0).random((TRIED, space.n_var)))
        runner.run(X)
        roads, _ = runner.roads_of(X[:1])
        rollout = runner.nominal_batch().run()
        facts = facts_of(rollout, 0, roads.corridors([0])[0])
        if facts.own_bodies != 1:
            raise InputError("the ego has a trailer")
        room, measuring = verdict_of(*rollout.shape[1:]), measuring_of(rollout, 0)
        program = runner.embedded.program
        found = portable.tables(program, roads, facts=facts, measuring=measuring, verdict=room)
        if (size := len(found["data"])) > MOST:
            kilobytes = f"{size // 1000} kB of a page, {MOST // 1000} kB at most"
            raise InputError(f"its road network takes {kilobytes}")
    except InputError as error:
        return {"refused": str(error)}
    told = in_the_mirror if runner.left_hand else str
    return found | {
        "kernels": _kernels(),
        "space": _space(space),
        "judged": {
            "columns": {name.lower(): getattr(codes, name) for name in COLUMNS},
            "harm": HARM,
            "kinds": [KINDS.get(kind, "") for kind in range(codes.VIOLATION + 1)],
            "types": [kind.label for kind in ConflictType],
            "responsible": [who.label for who in Responsible],
            "rules": [told(rule.label) for rule in Rule],
            "zones": [int(zone.other_side if runner.left_hand else zone) for zone in Zone],
            "side": -1 if runner.left_hand else 1,
            **_measured(pipeline),
            **_verdict(pipeline),
        },
        "commands": list(commands),
        "file": storyboard_payload(pipeline, X[:FILES]),
        "unused": [name for name in space.names if name in runner.source.unused_names],
    }


def _measured(pipeline: Pipeline) -> dict[str, Any]:
    """Return the metrics of the search by name, unit and where they are found, and what is not.

    "implausible": reasons by code; "metrics": their numbers in ``MEASURED``, and whether they need
    detections, or see ``OF_CONFLICT``.
    """
    metrics, unmeasured = [], []
    for name in pipeline.metrics:
        if name.startswith((PREFIX, OF_BASELINE)):
            continue
        if name in MEASURED:
            at = MEASURED.index(name)
            metrics.append([name, quantities.get(name).unit, at, at >= IOU])
        elif name in OF_CONFLICT:
            metrics.append([name, quantities.get(name).unit, OF_CONFLICT[name], False])
        else:
            unmeasured.append(name)
    reasons = [reason.label for reason in Implausible]
    return {"metrics": metrics, "unmeasured": unmeasured, "implausible": reasons}


def _verdict(pipeline: Pipeline) -> dict[str, bool]:
    """Return what the search's verdict on a row depends on besides conflicts.

    "alone": on no pass criteria, thresholds, cause or other driver; "gated": on plausibility;
    "criteria": whether some are measured.
    """
    objective = getattr(pipeline, "objective", None) or pipeline.scenario.objective
    beside = pipeline.cause is not None or pipeline.baseline is not None
    return {
        "alone": objective.rule == "harm" and not beside,
        "gated": objective.gated,
        "criteria": bool(pipeline.monitor.names),
    }


@cache
def _kernels() -> str:
    return deflated(portable.MODULE.read_bytes())


def _refuse_what_is_not_portable(pipeline: Pipeline) -> None:
    runner = pipeline.runner
    if not portable.MODULE.is_file():
        raise InputError("this installation has no kernels for pages")
    if not pipeline.tries:
        raise InputError("another simulator runs its scenarios")
    if isinstance(runner.source, AdversarySource):
        raise InputError("a participant is driven by an adversary")
    if not runner.has_one_network:
        raise InputError("its scenarios differ in the road network")
    if runner.has_variants:
        raise InputError("its scenarios differ in the storyboard, not in numbers alone")


def _space(space: SearchSpace) -> list[dict[str, Any]]:
    """Return the parameters in the order in which they depend on each other.

    A derived one has a "formula"; "bounds" are pairs of formulas, of the lowest and the highest
    value, or null.
    """
    found: list[dict[str, Any]] = []
    for name in space.order:
        if name in space.derived:
            found.append({"name": name, "formula": space.derived[name].value.as_json()})
            continue
        parameter = space.parameters[name]
        found.append(
            {
                "name": name,
                "low": parameter.low,
                "high": parameter.high,
                "default": space.defaults[name],
                "whole": parameter.kind.apart,
                "searched": name in space.variables,
                "bounds": [
                    [limit and limit.as_json() for limit in (bound.lo, bound.hi)]
                    for bound in space.bounds[name]
                ],
            }
        )
    return found
