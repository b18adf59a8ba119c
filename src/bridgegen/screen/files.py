"""Scenario files, recordings, drivers: what simulating, measuring and trying them came to."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridgegen.campaign.driver_contract import Check
    from bridgegen.metrics.measure import Measured
    from bridgegen.simulate import FileResult


def print_file_result(file: Path, result: "FileResult") -> None:
    """Print what one scenario file came to."""
    print(f"{file}: ego {result.driver}, {result.seconds:g} s simulated")
    if result.status != "ok":
        print(f"failed: {result.status}")
    if result.cause is not None:
        print(f"cause of its harm, as it was found: {result.cause}")
    for one in result.incidents:
        print(f"at {one.step * result.rollout.time_step:.2f} s: {one.kind}: {one.what}")
    _print_metrics(result.metrics)


def print_measured(file: Path, measured: "Measured", *, as_json: bool) -> None:
    """Print what a recording came to."""
    rollout, n = measured.rollout, measured.rollout.shape[2]
    if as_json:
        facts = {
            "file": str(file), "ego": rollout.names[0], "entities": rollout.names, "instants": n,
            "time_step": rollout.time_step, "metrics": _finite(measured.metrics),
            "notes": measured.notes,
        }  # fmt: skip
        print(json.dumps(facts, indent=2))
        return
    print(
        f"{file}: ego {rollout.names[0]}, {len(rollout.names) - 1} others, {measured.seconds:g} s "
        f"in {n} instants"
    )
    _print_metrics(measured.metrics)


def _print_metrics(values: Mapping[str, float]) -> None:
    from bridgegen.metrics import METRICS

    width = max(len(name) for name in values)
    for name, value in values.items():
        unit = METRICS[name].unit
        print(f"{name:<{width}}  {value:.6g}{'' if unit == '1' else ' ' + unit}")


def _finite(values: Mapping[str, float]) -> dict[str, float | None]:
    """Return values as JSON has them: null for what is infinite or NaN."""
    return {name: value if isfinite(value) else None for name, value in values.items()}


def print_checks(checks: "Iterable[Check]", *, as_json: bool) -> bool:
    """Print what was tried on a driver as it comes in; return whether it kept everything."""
    done, scenario = [], ""
    for check in checks:
        done.append(check)
        if as_json:
            continue
        if check.scenario != scenario:
            scenario = check.scenario
            print(scenario)
        sign = "no " if check.problem else "   " if check.figure else "ok "
        print(f"  {sign} {check.rule}" + (f": {check.figure}" if check.figure else ""))
        if check.problem:
            print(f"        {check.problem}")
    if as_json:
        print(json.dumps([asdict(check) for check in done], indent=2))
    return not any(check.problem for check in done)
