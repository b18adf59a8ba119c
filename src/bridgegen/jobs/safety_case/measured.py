"""The numbers that a run supports, each by its definition in ``recompute.py``."""

import shlex
from collections import Counter

import numpy as np

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.safety_case.numbers import RUN, TRIAGE, Numbers
from bridgegen.results.confirmation.record import file_name
from bridgegen.results.confirmation.summary import summarise
from bridgegen.search.triage.record import Mode

Way = tuple[str, str, str, str]
"""Way of failing: conflict, its type, the responsible participant and the rule, as recorded."""


def way_of(mode: Mode) -> Way:
    """Return the part of a failure mode's key that each row records."""
    return mode.conflict, mode.conflict_type, mode.responsible, mode.rule


def ways(facts: Facts) -> dict[Way, int]:
    """Return the number of harmful evaluations of each way to fail, the most frequent first."""
    counts: Counter[Way] = Counter()
    for mode in facts.triage.modes:
        for rule, count in mode.rules or ((mode.rule, mode.count),):
            counts[*way_of(mode)[:3], rule] += count
    return dict(counts.most_common())


def measure(facts: Facts, numbers: Numbers) -> None:
    """Add all numbers of a run."""
    _evaluations(facts, numbers)
    _failures(facts, numbers)
    measure_space(facts, numbers)
    _coverage(facts, numbers)
    _criteria(facts, numbers)
    for record in facts.confirmations:
        found, file = summarise(record.scenarios), file_name(record.simulator)
        for name, value in (("ran", found.ran), ("confirmed", found.confirmed)):
            numbers.add(f"{name}:{record.simulator}", value, of=file, source=file)


def _evaluations(facts: Facts, numbers: Numbers) -> None:
    rows, bound = facts.rows, facts.triage.bound
    ok = rows.status == 0
    fit = ok & (rows.findings.implausible == "")
    numbers.add("evaluations", bound.evaluations)
    numbers.add("failed", bound.failed)
    numbers.add("implausible", bound.implausible)
    numbers.add("critical", int(rows.critical.sum()))
    if "d_min" in facts.columns and ok.any():
        numbers.add("d_min", float(facts.columns["d_min"][ok].min()), "number", unit="m")
    if "n_collision" in facts.columns:
        collides = facts.columns["n_collision"] > 0.0
        numbers.add("collisions", int((ok & collides).sum()))
        if (ok & collides).any() and facts.triage.count == "ego":
            spared = fit & collides & (facts.harm < NEAR_MISS)
            numbers.add("not_preventable", int(spared.sum()))


def _failures(facts: Facts, numbers: Numbers) -> None:
    triage = facts.triage
    found = triage.bound.harmful + facts.fresh_harmful
    numbers.add("harmful", triage.bound.harmful)
    numbers.add("failures", found)
    if facts.run.settings.cause is not None:
        fit = (facts.rows.status == 0) & (facts.rows.findings.implausible == "")
        every = int((fit & (facts.harm >= NEAR_MISS)).sum())
        numbers.add("other_causes", every - triage.bound.harmful)
    nearest = () if found else triage.bound.least
    for least in nearest:
        if least.value is not None and least.evaluation is not None:
            name, of = least.quantity, least.quantity
            numbers.add(f"least:{name}", least.value, "number", of=of, unit=least.unit)
            numbers.add(f"least_at:{name}", least.evaluation + 1, of=of)
    if triage.modes:
        numbers.add("modes", len(triage.modes) + triage.unrecorded_modes, source=TRIAGE)
        if not triage.untested:
            numbers.add("robust_modes", triage.robust, source=TRIAGE)
    if not triage.unrecorded_modes:
        for k, (way, count) in enumerate(ways(facts).items(), start=1):
            numbers.add(f"way{k}", count, of="|".join(way))
    for mode in triage.modes:
        _mode(facts, mode, numbers)


def _mode(facts: Facts, mode: Mode, numbers: Numbers) -> None:
    """Add the numbers of a failure mode, and the words that its record has for it."""
    k, of, near = mode.number, str(mode.number), facts.triage.neighbourhood(mode.shown)
    numbers.add(f"title{k}", mode.title, "text", of=of, source=TRIAGE)
    if mode.minimal is not None and mode.minimal.sentence:
        numbers.add(f"simplest{k}", mode.minimal.sentence, "text", of=of, source=TRIAGE)
    numbers.add(f"count{k}", mode.count, of=of, source=TRIAGE)
    if near is not None:
        numbers.add(f"neighbours{k}", near.rows, of=of, source=TRIAGE)
        numbers.add(f"still_harmful{k}", near.harmful, of=of, source=TRIAGE)
    numbers.add(f"at{k}", mode.worst + 1, of=of)
    numbers.add(f"harm{k}", mode.harm, "number", of=of)
    if facts.severity:
        numbers.add(f"severity{k}", facts.severity[k - 1], "percent", of=of)


def measure_space(facts: Facts, numbers: Numbers) -> None:
    """Add the harmful share of the searched space, with its interval, if it was estimated."""
    space, fresh = facts.triage.bound.space, facts.triage.fresh
    if not space.drawn or not space.rows or space.share is None:
        return
    source = TRIAGE if fresh is not None else RUN
    drawn = len(fresh.harm) if fresh is not None else facts.triage.bound.evaluations
    numbers.add("drawn", drawn, source=source)
    numbers.add("drawn_known", space.rows, source=source)
    numbers.add("drawn_harmful", space.harmful, source=source)
    numbers.add("share", space.share, "percent", source=source)
    if space.harmful:
        numbers.add("share_low", space.low, "percent_down", source=source)
    numbers.add("share_high", space.high, "percent_up", source=source)


def _coverage(facts: Facts, numbers: Numbers) -> None:
    again = shlex.join(["bridgegen", "analyse", "coverage", facts.run.folder.resolve().name])
    for way in facts.coverage.ways:
        name = {1: "bins", 2: "pairs"}[way.strength]
        numbers.add(f"{name}_all", way.total)
        numbers.add(f"{name}_feasible", way.feasible, again=again)
        numbers.add(f"{name}_evaluated", way.evaluated)


def _criteria(facts: Facts, numbers: Numbers) -> None:
    for criterion in facts.run.criteria:
        name = criterion.criterion.id
        numbers.add(f"met:{name}", criterion.met, of=name)
        numbers.add(f"violated:{name}", criterion.violated, of=name)
        numbers.add(f"unknown:{name}", criterion.unknown, of=name)
        if criterion.at is not None and np.isfinite(criterion.worst):
            numbers.add(f"worst:{name}", criterion.worst, "number", of=name, unit=criterion.unit)
            numbers.add(f"worst_at:{name}", criterion.at, of=name)
