"""Results of simulating scenario files, measuring recordings and checking drivers."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bridgegen.assess.conflict.analysis import Conflicts
    from bridgegen.assess.conflict.recorded import Measured
    from bridgegen.assess.criteria import CriterionResult
    from bridgegen.engine.simulate import FileResult
    from bridgegen.jobs.search.driver_contract import Check


def print_file_result(file: Path, result: "FileResult") -> None:
    """Print the result of one scenario file."""
    from bridgegen.assess.criteria import margin_in_words

    print(f"{file}: ego {result.driver}, {result.seconds:g} s simulated")
    if result.status != "ok":
        print(f"failed: {result.status}")
    if result.cause is not None:
        print(f"cause of its harm, as it was found: {result.cause}")
    for incident in result.incidents:
        print(
            f"at {incident.step * result.rollout.time_step:.2f} s: {incident.kind}: {incident.what}"
        )
    _print_conflict(result.conflicts)
    if result.unjudged:
        print(f"not judged: {result.unjudged}")
    for each in result.criteria:
        text = each.criterion.text or each.criterion.states
        verdict = f"{each.verdict} (margin {margin_in_words(each.margin, each.unit)})"
        print(f"criterion {each.criterion.id} {verdict}: {text}")
    _print_metrics(result.metrics)


def criteria_facts(results: "Iterable[CriterionResult]") -> list[dict[str, Any]]:
    """Return how a file meets criteria as JSON's types."""
    return [
        result.criterion.to_dict()
        | {
            "verdict": result.verdict,
            "margin": result.margin if isfinite(result.margin) else None,
            "unit": result.unit,
        }
        for result in results
    ]


def conflict_facts(conflicts: "Conflicts", assumptions: Iterable[str] = ()) -> dict[str, Any]:
    """Return the decisive conflict of a file as JSON's types; ``conflict`` is None without one.

    Args:
        conflicts: N = 1.
        assumptions: what the analysis assumes.
    """
    from bridgegen.assess.conflict.summary import summarise

    summary = summarise(conflicts)
    facts = None if summary is None else summary.to_dict() | {"assumptions": [*assumptions]}
    return {"conflict": facts}


def _print_conflict(conflicts: "Conflicts", assumptions: Iterable[str] = ()) -> None:
    """Print the decisive conflict: a sentence, then its facts."""
    from bridgegen.assess.conflict.summary import CAREFUL_DRIVER, summarise

    summary = summarise(conflicts)
    if summary is None:
        print("conflict: none")
        return
    print(f"conflict: {summary.sentence}")
    lines: list[tuple[str, str]] = []
    violates = summary.conflict == "violation"
    if summary.happened:
        prevents = "would" if summary.preventable else "would not"
        lines += [
            ("type", f"{summary.conflict}, {summary.type} ({summary.type_source})"),
            ("responsible", summary.responsible),
            ("rule", f"{summary.rule}: {summary.rule_says} ({summary.rule_source})"),
        ]
    if violates:
        lines += [
            ("began", f"at {summary.decided:.2f} s, worst at {summary.time:.2f} s"),
            ("by", f"{abs(summary.aside):.2f} m at {summary.v_ego:.1f} m/s"),
        ]
    elif summary.happened:
        lines += [
            ("zones", f"ego {summary.zone_ego}, {summary.partner} {summary.zone_other}"),
            ("decided", f"at {summary.decided:.2f} s, {summary.left:.2f} s before contact"),
            ("preventable", f"{CAREFUL_DRIVER} {prevents} have avoided it"),
        ]
    lines += (
        []
        if violates
        else [
            (
                "closing speed",
                f"{summary.closing_normal:.1f} m/s across the surfaces that meet, "
                f"{summary.closing_tangential:.1f} m/s along them",
            ),
        ]
    )
    if summary.conflict == "contact":
        lines += [
            (
                "delta-v",
                f"ego {summary.delta_v_ego:.1f} m/s, "
                f"{summary.partner} {summary.delta_v_other:.1f} m/s",
            ),
            ("severity", f"{summary.severity:.3g} (probability of a MAIS3+ injury)"),
        ]
    elif not violates:
        lines += [
            ("least TTC", f"{summary.ttc:.2f} s at {summary.time:.2f} s"),
            ("deceleration", f"{summary.needed_deceleration:.1f} m/s² needed then"),
        ]
    for name, text in lines:
        print(f"  {name:<13}  {text}")
    for text in assumptions if summary.happened else ():
        print(f"  {'assumed':<13}  {text}")


def print_measured(file: Path, measured: "Measured", *, as_json: bool) -> None:
    """Print the metrics of a recording."""
    rollout, n = measured.rollout, measured.rollout.shape[2]
    if as_json:
        facts = {
            "file": str(file),
            "ego": rollout.names[0],
            "entities": rollout.names,
            "instants": n,
            "time_step": rollout.time_step,
            "metrics": _finite(measured.metrics),
            "notes": measured.notes,
            **conflict_facts(measured.conflicts, measured.assumptions),
        }
        print(json.dumps(facts, indent=2))
        return
    print(
        f"{file}: ego {rollout.names[0]}, {len(rollout.names) - 1} others, {measured.seconds:g} s "
        f"in {n} instants"
    )
    _print_conflict(measured.conflicts, measured.assumptions)
    _print_metrics(measured.metrics)


def _print_metrics(values: Mapping[str, float]) -> None:
    from bridgegen.assess.conflict.quantities import QUANTITIES

    width = max(len(name) for name in values)
    for name, value in values.items():
        unit = QUANTITIES[name].unit
        print(f"{name:<{width}}  {value:.6g}{'' if unit == '1' else ' ' + unit}")


def _finite(values: Mapping[str, float]) -> dict[str, float | None]:
    """Return values for JSON: None if infinite or NaN."""
    return {name: value if isfinite(value) else None for name, value in values.items()}


def print_checks(checks: "Iterable[Check]", *, as_json: bool) -> bool:
    """Print the checks of a driver as they complete; return whether all passed."""
    done, scenario = [], ""
    for check in checks:
        done.append(check)
        if as_json:
            continue
        if check.scenario != scenario:
            scenario = check.scenario
            print(scenario, flush=True)
        sign = "no " if check.problem else "   " if check.figure else "ok "
        print(f"  {sign} {check.rule}" + (f": {check.figure}" if check.figure else ""))
        if check.problem:
            print(f"        {check.problem}")
    if as_json:
        print(json.dumps([asdict(check) for check in done], indent=2))
    return not any(check.problem for check in done)
