"""Logical scenarios made of recorded events: ranges that hold what was seen, and exposure."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.events.of_scenarios import ScenarioEvents, Sought, broken_by, whole_share
from bridgegen.recordings.scenarios.draft import MinedRange, draft, dumped, files_of
from bridgegen.recordings.scenarios.ranges import LEAST_SEEN, fitted_names, held_in_words
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.exposure.fit import LEAST_ROWS, Fit, Progress, fit_exposure
from bridgegen.scenario.language.scenario import LogicalScenario

REPLICATES = 100
"""Number of resampled fits, for bands and p values."""
NAMES_SHOWN = 5
"""Number of recordings that are named."""
HEAD = "# Mined by 'bridgegen mine'. A later call replaces this file: change a copy of it."


@dataclass(frozen=True, eq=False)
class MinedScenario:
    """A scenario made of events.

    Attributes:
        name: of it, and of its file.
        source: name of the scenario that it was made from.
        text: the file.
        ranges: of its parameters.
        tightened: constraints that keep derived speeds within what was seen.
        events: that its ranges are of.
        met: how often it was met; None if nobody counted.
        fit: of its exposure; None where the events are too few for a distribution.
    """

    name: str
    source: str
    text: str
    ranges: tuple[MinedRange, ...]
    tightened: tuple[str, ...]
    events: int
    met: Encounters | None
    fit: Fit | None

    def facts(self) -> list[str]:
        """Return what was found, a few words each."""
        if self.fit is not None:
            return [*self.fit.facts()]
        rate = self.met.per_hour if self.met else None
        met = [rate.in_words("h")] if rate else []
        few = f"no distribution and no exposure: {LEAST_ROWS} events are needed"
        return [held_in_words(self.events), *met, few]


@dataclass(frozen=True)
class Unmade:
    """A scenario that was met, and of which none is made.

    Attributes:
        source: its name.
        reason: why.
    """

    source: str
    reason: str


def mined_scenario(
    sought: Sought,
    events: ScenarioEvents,
    found: Sequence[FoundEvents],
    table: Path,
    time_step: float,
    progress: Progress | None = None,
) -> MinedScenario | Unmade:
    """Return the scenario that events are, or why there is none.

    Args:
        sought: the source scenario.
        events: that are it.
        found: all events, of which these are.
        table: the file of these events' parameters.
        time_step: after cleaning [s].
        progress: is told how many of how many parameters are fitted.
    """
    scenario = sought.scenario
    enough = f"{LEAST_SEEN} are needed for ranges, {LEAST_ROWS} for a distribution"
    if events.complete < LEAST_SEEN:
        return Unmade(scenario.name, f"{events.complete} events; {enough}")
    good = np.ones(events.complete, np.bool_)
    for _, breaks in broken_by(scenario, events.rows):
        good &= ~breaks
    count = int(good.sum())
    if count < LEAST_SEEN:
        return Unmade(
            scenario.name,
            f"{count} of {events.complete} events keep its constraints; {enough}",
        )
    if own := files_of(sought):
        return Unmade(scenario.name, f"{own} lies beside its file: use --update")
    rows = {name: values[good] for name, values in events.rows.items()}
    names = fitted_names(scenario, rows)
    if not names:
        return Unmade(scenario.name, "the events give none of the parameters that it searches")
    about = _about(events, found, time_step)
    if count < LEAST_ROWS:
        about += f" {held_in_words(count)}; too few for a distribution."
    try:
        made = draft(sought, rows, names, about)
        met = events.encounters
        fitted = (
            None
            if count < LEAST_ROWS
            else fit_exposure(
                made.scenario,
                table,
                hours=met.hours if met else None,
                km=met.km if met else None,
                ignore=[name for name in events.rows if name not in names],
                others="default" if _rest(made.scenario, names) else None,
                source=about,
                replicates=REPLICATES,
                progress=progress,
            )
        )
    except InputError as error:
        return Unmade(scenario.name, "; ".join(error.problems))
    block = fitted.text[fitted.text.index("\nexposure:") + 1 :] if fitted else ""
    return MinedScenario(
        made.scenario.name,
        scenario.name,
        f"{HEAD}\n{dumped(made.data)}{block}",
        made.ranges,
        tuple(str(bound) for bound in made.tightened),
        fitted.used if fitted else count,
        fitted.exposure.encounters if fitted else met,
        fitted,
    )


def _rest(scenario: LogicalScenario, names: Sequence[str]) -> list[str]:
    return [name for name in scenario.space().variables if name not in names]


def _about(events: ScenarioEvents, found: Sequence[FoundEvents], time_step: float) -> str:
    """Return where the events come from, and what was left out."""
    recordings = [found_events.recording for found_events in found]
    shown = ", ".join(recordings[:NAMES_SHOWN]) + (", …" if recordings[NAMES_SHOWN:] else "")
    count = "1 recording" if len(recordings) == 1 else f"{len(recordings)} recordings"
    refused: Counter[str] = Counter()
    for item in (each for every in found for each in every.kinds if each.kind.name == events.kind):
        refused.update(item.refused)
    reasons = "; ".join(f"{number} {reason}" for reason, number in refused.items())
    left_out = f"candidates refused: {reasons or 'none'}"
    hours, km = np.sum([found_events.driving(events.kind) for found_events in found], axis=0)
    text = (
        f"{events.count} events of the kind {events.kind} in {count} ({shown}), resampled to "
        f"{time_step:g} s; {hours:.4g} h and {km:.4g} km of motor vehicles, each of which may be "
        f"the ego; {left_out}"
    )
    if (share := whole_share(found, events.kind)) < 1.0:
        text += f"; hours and km of encounters are {share:.3g} of these, as others are cut off"
    if events.incomplete:
        text += f"; {events.incomplete} events lack a parameter"
    return text + "."
