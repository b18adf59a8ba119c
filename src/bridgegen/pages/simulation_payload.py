"""What a report simulates scenarios with: kernels, a storyboard's tables, the parameters' rules."""

from typing import Any

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.packed import deflated
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.adversary import AdversarySource
from bridgegen.simulation.embedded import portable

TRIED = 64
"""Number of random rows that are run first, so that the ways are planned that rows may need."""


def simulation_payload(pipeline: Pipeline) -> dict[str, Any]:
    """Return what ``simulator.js`` and ``explore.js`` need; or only "refused", why they cannot."""
    try:
        _refuse_what_is_not_portable(pipeline)
        space, runner = pipeline.space, pipeline.runner
        X = space.decode(np.random.default_rng(0).random((TRIED, space.n_var)))
        runner.run(X)
        roads, _ = runner.roads_of(X[:1])
        found = portable.tables(runner.embedded.program, roads)
    except InputError as error:
        return {"refused": str(error)}
    return found | {
        "kernels": deflated(portable.MODULE.read_bytes()),
        "space": _space(space),
        "unused": [name for name in space.names if name in runner.source.unused_names],
    }


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
