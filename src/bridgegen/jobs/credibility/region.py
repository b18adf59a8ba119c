"""The validated region of each scenario: what its confirmed rows and accepted tests span."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.arrays import Float, Int
from bridgegen.jobs.credibility.measured import RealTest
from bridgegen.jobs.credibility.model import Comparison
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.results.store import Recorded, Store
from bridgegen.results.validated import Region, extrapolated

Key = tuple[str, str, str]
"""Scenario, its fingerprint, and the ego's vehicle."""


def regions(
    runs: Mapping[str, Facts], tests: Sequence[RealTest], compared: Sequence[Comparison]
) -> list[Region]:
    """Return the regions, in the order of the runs.

    Args:
        runs: by id.
        tests: real ones; a row counts if it is accepted in a quantity and refused in none.
        compared: verdicts on them.
    """
    verdicts = {(one.run, one.series, one.quantity): one.verdict for one in compared}
    spans, words = defaultdict[Key, list[Float]](list), defaultdict[Key, list[str]](list)
    for name, facts in runs.items():
        settings, of = facts.run.settings, {"accepted": set[int](), "not accepted": set[int]()}
        for test in tests:
            if test.run == name:
                verdict = verdicts[test.run, test.series, test.quantity]
                of.setdefault(verdict, set()).add(test.evaluation)
        rows = {f"accepted beside real tests with {facts.ego}": of["accepted"] - of["not accepted"]}
        for record in facts.confirmations:
            some = {one.evaluation for one in record.scenarios if one.confirmed}
            rows[f"confirmed in {record.label} with {facts.ego}"] = some
        key = facts.triage.scenario, settings.fingerprint, str(settings.vehicle)
        if every := sorted(set().union(*rows.values())):
            spans[key].append(_numbers(facts, np.array(every)))
            words[key] += [f"{len(some)} rows {how}" for how, some in rows.items() if some]
    units = {name: unit for facts in runs.values()
             for name, unit in zip(facts.space.names, facts.space.units, strict=True)}  # fmt: skip
    names = {facts.run.settings.fingerprint: numeric(facts) for facts in runs.values()}
    return [
        Region(
            scenario=scenario, fingerprint=digest, vehicle=vehicle,
            evidence=", ".join(words[scenario, digest, vehicle]),
            ranges={name: (float(x.min()), float(x.max()), units[name])
                    for name, x in zip(names[digest], np.concatenate(found).T, strict=True)},
        )
        for (scenario, digest, vehicle), found in spans.items()
    ]  # fmt: skip


def numeric(facts: Facts) -> list[str]:
    """Return the parameters whose values are numbers."""
    return [name for name in facts.space.parameters if name not in facts.space.labels]


def _numbers(facts: Facts, rows: Int) -> Float:
    with Store.open(facts.run.folder) as store:
        X: Float = Recorded(store).X[rows]
    return np.stack([X[:, facts.space.names.index(name)] for name in numeric(facts)], axis=1)


def warning(facts: Facts, found: Sequence[Region]) -> str:
    """Return whether the exported findings of a run lie outside its region; "" if none does."""
    rows = [item.evaluation for item in exported_scenarios(facts.run.folder)]
    rows = [row for row in rows if facts.harm[row] >= NEAR_MISS]
    settings, X = facts.run.settings, _numbers(facts, np.array(rows, dtype=np.int64))
    return extrapolated(found, settings.fingerprint, str(settings.vehicle), numeric(facts), X)[1]
