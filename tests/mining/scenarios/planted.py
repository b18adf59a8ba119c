"""Events of a scenario with planted parameters, as mining finds them."""

import csv

import numpy as np

from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.events.of_scenarios import Sought, encounters_of, scenario_events
from bridgegen.scenario.language.event_kinds import EVENT_KINDS
from bridgegen.scenario.language.reader import build, document_of

HOURS, KM = 12.0, 700.0


def sought(source):
    document, folder = document_of(source)
    scenario = build(document, folder)
    return Sought(scenario, scenario.recorded, document, source if folder is not None else None)


def approaches(n, seed=0, **planted):
    """Return n approaches of slow traffic; other quantities are planted, ``(n,)`` each."""
    rng = np.random.default_rng(seed)
    ego = rng.uniform(4.0, 25.0, n)
    slower = np.minimum(rng.exponential(1.5, n) + 2.0, 0.8 * ego)
    gap = slower * rng.uniform(4.0, 10.0, n)
    return events("approach", {"ego_speed": ego, "relative_speed": slower, "gap": gap} | planted)


def events(kind, quantities, refused=None):
    declared = EVENT_KINDS[kind]
    n = len(next(iter(quantities.values())))
    every = {name: np.full(n, np.nan) for name in declared.quantities} | quantities
    someone = np.arange(n)
    one = Events(
        declared, someone, dict.fromkeys(declared.roles, someone + 1), np.zeros(n), np.ones(n),
        every, refused or {},
    )  # fmt: skip
    return FoundEvents(
        "a recording", "a.csv", tuple(map(str, range(n + 1))), (one,), HOURS, KM, HOURS, KM, False
    )


def met(one, found, folder):
    """Return the events that a scenario is, and the table of them."""
    made = scenario_events(one.scenario, one.spec, [found])
    path = folder / f"{made.scenario}.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(made.rows)
        writer.writerows(zip(*(values.tolist() for values in made.rows.values()), strict=True))
    assert made.encounters == encounters_of(made.count, [found], made.kind)
    return made, path
