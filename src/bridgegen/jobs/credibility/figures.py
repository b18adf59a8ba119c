"""The figures of a dossier, each by its definition in ``recompute.py``."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from importlib.metadata import distributions
from itertools import groupby
from pathlib import Path
from statistics import median

import numpy as np

from bridgegen.base.statistics import clopper_pearson
from bridgegen.jobs.credibility.convergence import (
    QUANTITIES,
    STEPS,
    Convergence,
    finest,
    series,
    state,
)
from bridgegen.jobs.credibility.model import Flip
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.safety_case.measured import measure_space
from bridgegen.jobs.safety_case.model import Form, Number
from bridgegen.jobs.safety_case.numbers import RUN, TRIAGE, Numbers
from bridgegen.results.confirmation.record import PREFIX
from bridgegen.results.confirmation.summary import summarise
from bridgegen.scenario.exposure.reader import read_parameterisation
from bridgegen.scenario.language.parameterisation import Parameterisation
from bridgegen.search.triage.record import AtStep, StepCheck

SENSITIVITY = "sensitivity.json"
"""File of a run's folder that says which constants of the models its verdicts depend on."""

EXPOSURE, BLOCK = "exposure.yaml", b"\n  parameterisation:"
"""File of a run's folder that ``bridgegen fit`` writes, and how its block on recorded twins
begins."""


def twins_of(folder: Path) -> Parameterisation | None:
    """Return what a run's folder says of recorded events and their twins; None: nothing.

    Raises:
        BridgeGenError: its exposure cannot be read.
    """
    path = folder / EXPOSURE
    found = read_parameterisation(path) if path.is_file() else None
    return found if found and BLOCK in path.read_bytes() else None


EVERY = "all"
"""The first part of the ids of numbers that are of all runs together."""


def measure(runs: Mapping[str, Facts]) -> dict[str, Number]:
    """Return the numbers of runs, and those of all of them together, by id.

    Args:
        runs: by id; those that were read.
    """
    every = Numbers(EVERY)
    found = [_of_run(name, facts) for name, facts in runs.items()]
    every.add("runs", len(runs), source="")
    for name in ("evaluations", "failed"):
        every.add(name, sum(getattr(facts.triage.bound, name) for facts in runs.values()))
    every.add("versions", len({facts.run.version for facts in runs.values()}))
    ways = [facts.coverage.ways[0] for facts in runs.values() if facts.coverage.ways]
    every.add("bins_all", sum(way.total for way in ways))
    every.add("bins_evaluated", sum(way.evaluated for way in ways))
    for name, of in (("shares", "share_high"), ("combined", "share_high_steps")):
        if count := sum(of in numbers for numbers in found):
            every.add(name, count)
    exposed = sum(facts.run.settings.distribution is not None for facts in runs.values())
    if exposed:
        every.add("distributions", exposed)
    if analysed := sum((facts.run.folder / SENSITIVITY).is_file() for facts in runs.values()):
        every.add("sensitivity", analysed, source=SENSITIVITY)
    if recorded := sum(twins_of(facts.run.folder) is not None for facts in runs.values()):
        every.add("recorded", recorded, source=EXPOSURE)
    _of_steps(list(runs.values()), every)
    _of_simulators(list(runs.values()), every)
    return {number.id: number for numbers in (*found, every) for number in numbers.all}


def _of_run(name: str, facts: Facts) -> Numbers:
    """Return the numbers of one run."""
    numbers = Numbers(name)
    measure_space(facts, numbers)
    space, drawn = facts.triage.bound.space, facts.triage.bound.space.drawn
    rest = [check for check in facts.triage.step_checks if not check.at[0].harmful]
    # A sample of a search's rows is one of the space only where no algorithm chose these rows.
    if drawn in ("random", "sobol") and rest:
        turned = sum(any(one.harmful or not one.ok for one in check.at) for check in rest)
        high = clopper_pearson(turned, len(rest))[1]
        numbers.add("share_high_steps", space.high + (1.0 - space.high) * high, "percent_up")
    return numbers


def _of_steps(runs: Sequence[Facts], numbers: Numbers) -> None:
    """Add whether findings and a sample of the others depend on the time step, and errors."""
    checks = [(facts, check) for facts in runs for check in facts.triage.step_checks]
    if not checks:
        return

    def add(
        name: str, value: float, form: Form = "count", *, of: str = "", unit: str = "1"
    ) -> None:
        numbers.add(f"{name}:{of}" if of else name, value, form, of=of, source=TRIAGE, unit=unit)

    add("checked", len(checks))
    same = [facts.harm[check.evaluation] == check.at[0].harm for facts, check in checks]
    numbers.add("same", sum(map(bool, same)), source=RUN)
    findings = [check for _, check in checks if check.at[0].harmful]
    rest = [check for _, check in checks if not check.at[0].harmful]
    for name, some in (("findings", findings), ("sample", rest)):
        if not some:
            continue
        flips = sum(not check.stable for check in some)
        add(name, len(some))
        add(f"{name}_stable", len(some) - flips)
        add(f"{name}_flips", flips)
        low, high = clopper_pearson(flips, len(some))
        add(f"{name}_flips_low", low, "percent_down")
        add(f"{name}_flips_high", high, "percent_up")
        for steps in STEPS[1:]:
            at = [pair for check in some for pair in _at(check, steps)]
            add(f"{name}_at", len(at), of=str(steps))
            add(f"{name}_kept", sum(state(a) == state(b) for a, b in at), of=str(steps))
    for quantity, unit in QUANTITIES.items():
        found = [(check, series(check, quantity)) for check in findings]
        rows = [(check, row) for check, row in found if row is not None]
        if not rows:
            continue
        made = [Convergence.of(row, finest(check, quantity)) for check, row in rows]
        add("series", len(made), of=quantity)
        add("unchanged", sum(len(set(row)) == 1 for _, row in rows), of=quantity)
        for name in ("error", "extrapolated", "gci", "stated"):
            values = [getattr(one, name) for one in made]
            add(f"{name}_median", median(values), "number", of=quantity, unit=unit)
            add(f"{name}_q95", float(np.quantile(values, 0.95)), "number", of=quantity, unit=unit)
        orders = [one.order for one in made if one.order is not None]
        add("orders", len(orders), of=quantity)
        if orders:
            add("order_median", median(orders), "number", of=quantity)


def _at(check: StepCheck, steps: int) -> list[tuple[AtStep, AtStep]]:
    """Return the results of a check at the scenario's step and at a fraction of it, if any."""
    return [(check.at[0], one) for one in check.at if one.steps == steps]


def _of_simulators(runs: Sequence[Facts], numbers: Numbers) -> None:
    """Add the agreement with each other simulator."""
    by_name = defaultdict(list)
    for facts in runs:
        for record in facts.confirmations:
            found = summarise(record.scenarios)
            if found.ran:
                by_name[record.simulator].append(found)
    for k, name in enumerate(sorted(by_name), start=1):
        ran = sum(found.ran for found in by_name[name])
        confirmed = sum(found.confirmed for found in by_name[name])
        low, high = clopper_pearson(confirmed, ran)
        numbers.add(f"ran:{k}", ran, of=name, source=f"{PREFIX}*")
        numbers.add(f"confirmed:{k}", confirmed, of=name, source=f"{PREFIX}*")
        numbers.add(f"confirmed_low:{k}", low, "percent_down", of=name, source=f"{PREFIX}*")
        numbers.add(f"confirmed_high:{k}", high, "percent_up", of=name, source=f"{PREFIX}*")


def flips(runs: Mapping[str, Facts]) -> list[Flip]:
    """Return what depends on the time step, findings first."""
    found = [
        Flip(
            run=name,
            evaluation=check.evaluation + 1,
            is_finding=check.at[0].harmful,
            text="; ".join(
                f"{check.time_step / next(some).steps:g} s: {words}"
                for words, some in groupby(check.at, _words)
            ),
        )
        for name, facts in runs.items()
        for check in facts.triage.step_checks
        if not check.stable
    ]
    return sorted(found, key=lambda flip: not flip.is_finding)


def _words(one: AtStep) -> str:
    if not one.ok:
        return "no result"
    kind = one.conflict or "no conflict"
    return f"{kind}, {'a failure' if one.harmful else 'no failure'}, harm {one.harm:.3g}"


def installed() -> dict[str, str]:
    """Return the installed distributions with their versions, by name."""
    found = {
        str(item.metadata["Name"] or "unnamed")[:200]: str(item.version)[:100]
        for item in distributions()
    }
    return dict(sorted(found.items(), key=lambda pair: pair[0].lower()))
