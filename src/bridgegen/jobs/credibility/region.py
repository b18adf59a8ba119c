"""The validated region of each scenario: what its confirmed rows and accepted tests span."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.arrays import Float
from bridgegen.jobs.credibility.measured import RealTest
from bridgegen.jobs.credibility.model import Comparison
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.results.store import Recorded, Store
from bridgegen.results.validated import Region, extrapolated


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
    found = defaultdict[tuple[str, str, str], list[tuple[Facts, dict[str, set[int]]]]](list)
    for name, facts in runs.items():
        good, bad = (
            {
                test.evaluation for test in tests
                if test.run == name and verdicts[name, test.series, test.quantity] == word
            }
            for word in ("accepted", "not accepted")
        )  # fmt: skip
        rows = {f"accepted beside real tests with {facts.ego}": good - bad}
        for record in facts.confirmations:
            some = {one.evaluation for one in record.scenarios if one.confirmed}
            rows[f"confirmed in {record.label} with {facts.ego}"] = some
        settings = facts.run.settings
        key = facts.triage.scenario, settings.fingerprint, str(settings.vehicle)
        if any(rows.values()):
            found[key].append((facts, rows))
    made = []
    for (scenario, fingerprint, vehicle), some_runs in found.items():
        space = some_runs[0][0].space
        X = np.concatenate([_rows(one, set().union(*of.values())) for one, of in some_runs])
        pairs = [pair for _, of in some_runs for pair in of.items()]
        ranges = {
            name: (float(x.min()), float(x.max()), unit)
            for name, unit, x in zip(space.names, space.units, X.T, strict=True)
            if name in space.parameters and name not in space.labels
        }
        made.append(
            Region(
                scenario=scenario, fingerprint=fingerprint, vehicle=vehicle, ranges=ranges,
                evidence=", ".join(f"{len(rows)} rows {how}" for how, rows in pairs if rows)[:1000],
            )
        )  # fmt: skip
    return made


def _rows(facts: Facts, rows: Iterable[int]) -> Float:
    with Store.open(facts.run.folder) as store:
        X: Float = Recorded(store).X[np.array(sorted(rows), dtype=np.int64)]
    return X


def warning(facts: Facts, found: Sequence[Region]) -> str:
    """Return whether the exported findings of a run lie outside its region; "" if none does."""
    rows = [item.evaluation for item in exported_scenarios(facts.run.folder)]
    X = _rows(facts, [row for row in rows if facts.harm[row] >= NEAR_MISS])
    settings, names = facts.run.settings, facts.space.names
    return extrapolated(found, settings.fingerprint, str(settings.vehicle), names, X)[1]
