"""The storyboards of one search: rows share one, unless what they vary is part of its structure.

A compiled storyboard takes numbers from each row. A text (a catalogue's entry, a map's name) and a
number in a place that is compiled as a constant (a clothoid's length, the stop time) give each of
their values a storyboard of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from bridgegen.drivers import Driver
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.source import ConcreteScenario, Source
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

MOST_SHOWN = 60
"""Characters of what a parameter is used for, in a note."""


@dataclass(frozen=True)
class Variants:
    """What the storyboards of a search differ in.

    Attributes:
        names: the searched parameters whose values each need a storyboard of their own.
        notes: what is run otherwise than one may expect, a sentence each.
        kinds: what each participant is, "car", "pedestrian" or "car or truck" say, by its name.
    """

    names: tuple[str, ...]
    notes: tuple[str, ...]
    kinds: Mapping[str, str]

    @classmethod
    def of(
        cls,
        scenario: SearchedScenario,
        space: SearchSpace,
        source: Source,
        nominal: EmbeddedSimulator,
        driver: Driver | None,
    ) -> "Variants":
        """Return those of a scenario.

        Args:
            scenario: the logical scenario.
            space: its search space.
            source: makes its concrete scenarios.
            nominal: with the storyboard of the defaults.
            driver: of the ego; None leaves it to the storyboards.

        Raises:
            UnsupportedError: what one of the storyboards needs and cannot be run.
            InputError: see `EmbeddedSimulator`.
        """
        moving = {*space.variables}
        moving |= {one.name for one in scenario.derived if one.names & moving}
        texts, programs = moving & {*source.variant_names}, [nominal.program]
        for key in source.variants if texts else ():  # all, so that what is wrong is found now
            values = dict(zip(source.variant_names, key, strict=True))
            storyboard = nominal_of(source, space, values).storyboard
            programs.append(EmbeddedSimulator(storyboard, scenario.name, driver=driver).program)
        fixed = {name: use for one in programs for name, use in one.fixed.items()}
        varied = texts | (moving & fixed.keys())
        notes = [note for one in programs for note in one.notes]
        notes += [
            f"{scenario.place}: parameter '{name}' is used for {_short(fixed[name])}: each of its "
            "values is compiled by itself, which takes longer than its simulation"
            for name in space.names
            if name in varied - texts
        ]
        kinds: dict[str, dict[str, None]] = {}
        for one in programs:
            for name, kind in zip(one.names, one.kinds.tolist(), strict=True):
                kinds.setdefault(name, {})[NAMES[kind]] = None
        return cls(
            tuple(name for name in space.names if name in varied),
            tuple(dict.fromkeys(notes)),
            {name: " or ".join(found) for name, found in kinds.items()},
        )


def _short(use: str) -> str:
    """Return what a parameter is used for, a long formula cut."""
    return use if len(use) <= MOST_SHOWN else f"{use[: MOST_SHOWN - 1]}…"


def nominal_of(source: Source, space: SearchSpace, values: Mapping[str, float]) -> ConcreteScenario:
    """Return the concrete scenario of the defaults but for some values, whatever limits these."""
    return source.concrete(space.values(space.row({})) | dict(values))
