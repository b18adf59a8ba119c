"""A run's coverage."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.jobs.search.settings import Settings
    from bridgegen.scenario.language.coverage import Coverage, ParameterBins


def print_coverage(run: Path, settings: "Settings", found: "Coverage", *, as_json: bool) -> None:
    """Print the number of evaluated t-way combinations of bins, then each parameter's bins."""
    if as_json:
        print(json.dumps({"run": str(run), **_plain(asdict(found))}, indent=2))
        return
    print(
        f"{run}: {Path(settings.scenario).stem}, {settings.algorithm}, {found.evaluations} "
        f"evaluations, {found.critical} critical, {len(found.parameters)} parameters searched\n"
    )
    head = ("t", "combinations", "feasible", "evaluated", "of feasible", "critical")
    rows = [
        (w.strength, w.total, w.feasible, w.evaluated, f"{w.share:.1%}", w.critical)
        for w in found.ways
    ]
    print_table(head, rows, as_json=False)
    print(
        f"\nFeasible: found in {found.sample} random scenarios, or in the run; a lower bound. "
        "The constraints\nexclude others. Critical: combinations with a critical scenario.\n"
    )
    print("Evaluations per bin, lowest first, of these critical; – where none is feasible:")
    width = max(len(one.name) for one in found.parameters)
    for one in found.parameters:
        print(f"{one.name:<{width}}  {one.axis}, {one.span}")
        print(f"    {_cells(one)}")
        if one.met is not None:
            print("    " + "".join(f"{f'{share:.1%}':>10}" for share in one.met) + "  of the road")


def _cells(one: "ParameterBins") -> str:
    counts = zip(one.evaluated, one.critical, one.feasible, strict=True)
    return "".join(f"{f'{n}/{k}' if possible else '–':>10}" for n, k, possible in counts)


def _plain(value: Any) -> Any:
    """Return nested arrays and tuples as lists."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray) else value
