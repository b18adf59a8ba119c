"""The options of a run, each declared once; a stage takes the part that it needs.

To add one: a field here, and its use. `option` says what a declaration holds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from bridgegen.engine.options.forms import (
    CRITERIA,
    FIXED,
    FLAG,
    NAMES,
    NUMBER,
    ODD,
    PATH,
    SCREEN,
    SETTINGS,
    SIMULATOR,
    TERMS,
    TEXT,
    WHOLE,
)
from bridgegen.engine.options.option import DRIVER as OF_DRIVER
from bridgegen.engine.options.option import OBJECTIVE, OUTPUT, SEARCH, Declared, option
from bridgegen.engine.options.option import SIMULATOR as OF_SIMULATOR
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice, Value
from bridgegen.simulation.vehicles import KINEMATIC

MAX_BUDGET = 10**7
MAX_SEED = 2**32 - 1
MAX_KEEP = 1000
MAX_AHEAD = 10_000
MAX_REPEATS = 1000

OF_ODD = option(
    ODD,
    "Operational design domain: an ASAM OpenODD 1.0 file.",
    before=None,
)
"""Metadata of the field of an operational design domain."""

_CAUSES = option(
    FLAG,
    "Find the cause of each critical scenario: it is simulated again with one stage ideal.",
    before=False,
    group=OBJECTIVE,
)


# The parts that stages take are base classes of `SearchOptions`, and what a run records derives
# from that: so a restored run hands itself to the pipeline.
@dataclass(frozen=True, kw_only=True)
class PipelineOptions(Declared):
    """The options of how a scenario is evaluated."""

    ego: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Driver of the ego, see 'bridgegen list drivers'; or your own: module:Class, "
            "file.py:Class (or :function, compiled), file.fmu, connect:HOST:PORT, unix:PATH, "
            "'exec:COMMAND', egodriver://HOST:PORT.",
            shown="the scenario's choice",
            group=OF_DRIVER,
            names="driver",
        ),
    )
    driver_name: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "What the driver is called on pages and in results.",
            spelling="--name",
            shown="as --ego names it",
            before=None,
            group=OF_DRIVER,
        ),
    )
    ideal: Sequence[str] = field(
        default=(),
        metadata=option(
            NAMES,
            "Stages of the driver that work without fault: perception, prediction, control.",
            hint="Separated by commas.",
            shown="none",
            before=(),
            group=OF_DRIVER,
            names="stage",
        ),
    )
    vehicle: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "How the ego moves: kinematic, a bicycle within a friction circle; single-track, with "
            "tyres that slip, load transfer, and actuators that lag; or multi-body, with four "
            "wheels, roll and pitch besides (cars only; slow).",
            shown="kinematic, or what the file says",
            before=KINEMATIC,
            group=OF_DRIVER,
            names="vehicle",
        ),
    )
    worse_than: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Another driver, the baseline: only scenarios are critical in which the ego fails and "
            "this driver does not; the difference of their objectives is optimised.",
            hint="E.g. the version before a change.",
            shown="none",
            before=None,
            group=OF_DRIVER,
            names="driver",
        ),
    )
    time_limit: float | None = field(
        default=None,
        metadata=option(
            NUMBER,
            "Seconds that one call of a driver of your own may take; a compiled one, one scenario.",
            shown="10",
            group=OF_DRIVER,
        ),
    )
    metrics: Sequence[str] = field(
        default=(),
        metadata=option(
            NAMES,
            "Metrics to record besides the objective's and the paper's, see 'bridgegen list "
            "metrics'; or your own: file.py:METRIC.",
            hint="Separated by commas.",
            before=(),
            group=OUTPUT,
            names="metric",
        ),
    )
    criteria: Sequence[Mapping[str, str | Sequence[str]]] = field(
        default=(),
        metadata=option(
            CRITERIA,
            "Pass criterion to measure in every scenario: 'ID: FORMULA', or a YAML file with a "
            "list of criteria.",
            spelling="--criterion",
            hint="E.g. 'R-12: min(gap to any) > 1 m'; may be repeated.",
            shown="the scenario's",
            before=(),
            group=OBJECTIVE,
        ),
    )
    causes: bool = field(default=False, metadata=_CAUSES)
    cause: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Count only critical scenarios of this cause: perception, 'vehicle dynamics', "
            "planning, control or unavoidable.",
            shown="any",
            before=None,
            group=OBJECTIVE,
            names="cause",
        ),
    )

    @classmethod
    def of(cls, options: Declared, **changes: Any) -> Self:
        """Return the fields of other options that this class has too, some of them changed.

        Args:
            options: of any class; what it lacks keeps its default.
            changes: fields, by name; those that ``options`` lacks among them.
        """
        shared = vars(options).keys() & {item.name for item in fields(cls)}
        return cls(**{name: getattr(options, name) for name in shared} | changes)


@dataclass(frozen=True, kw_only=True)
class CommonOptions(PipelineOptions):
    """The options that a search and a comparison of searches have in common."""

    distribution: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "File with the ParameterValueDistribution of an OpenSCENARIO file's parameters.",
            before=None,
        ),
    )
    empty_trigger: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "When acts and events of a scenario file start whose StartTrigger is empty: never, as "
            "the standard says, or now, as in esmini.",
            shown="never",
            before=None,
        ),
    )
    axes: Sequence[str] | None = field(
        default=None,
        metadata=option(
            NAMES,
            "Axes to search, e.g. static,participants,weather.",
            hint="Separated by commas.",
            shown="the scenario's",
            names="axis",
        ),
    )
    fixed: Mapping[str, float | str] = field(
        default_factory=dict,
        metadata=option(
            FIXED,
            "Parameters to hold at a value, by name.",
            spelling="--fix",
            hint="NAME=VALUE, e.g. --fix fog_density=80; a category by name; may be repeated.",
            names="parameter",
        ),
    )
    odd: Mapping[str, Any] | Path | str | None = field(default=None, metadata=OF_ODD)
    road_map: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Map to search on: .xodr, .osm, or the .owl that it was imported as.",
            spelling="--map",
            shown="the scenario's roads",
        ),
    )
    junction: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Place on the map, as places lists them: a junction or a stretch of road; best: the "
            "one that fits and is most like the scenario's; all: each that fits, as one more "
            "parameter of the search.",
            spelling="--place",
            also="--junction",
        ),
    )
    objective: Mapping[str, float | None] | None = field(
        default=None,
        metadata=option(
            TERMS,
            "What to optimise: harm, paper, or metrics with their weights (none for --weights "
            "entropy).",
            hint="E.g. d_min=0.8,v_d=0.2.",
            shown="the scenario's",
            group=OBJECTIVE,
            names="objective",
        ),
    )
    weights: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Weights of the metrics: fixed, or entropy (of a random sample).",
            shown="the scenario's",
            before=None,
            group=OBJECTIVE,
            names="weights",
        ),
    )
    scale: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Scale of the metrics: raw, or standardised (by a random sample).",
            shown="the scenario's",
            before=None,
            group=OBJECTIVE,
            names="scale",
        ),
    )
    objectives: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Number of objectives: one, the metrics' weighted sum; or many, one for each metric.",
            shown="what the algorithm is made for",
            before=None,
            group=OBJECTIVE,
            names="objectives",
        ),
    )
    count: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Conflicts that count as harm: ego, those that the ego is responsible for or could "
            "have prevented; or any.",
            shown="ego",
            before=None,
            group=OBJECTIVE,
            names="count",
        ),
    )
    critical: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "What makes a scenario critical: harm, thresholds (the paper's), criteria (any that is "
            "violated), or some of them: criterion:ID, separated by commas.",
            shown="the scenario's, or what the objective says",
            before=None,
            group=OBJECTIVE,
            names="critical",
        ),
    )
    adversary: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Participant that an adversary drives instead of the scenario's events.",
            shown="none; with ppo-adversary the first vehicle",
            before=None,
            group=OF_DRIVER,
        ),
    )
    others: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Driver of all other participants: attentive, lawful (so are people on foot and on "
            "cycles), insistent (gives way to none), or scripted (they react to nothing).",
            shown="what the scenario says",
            before="scripted",
            group=OF_DRIVER,
            names="others",
        ),
    )


@dataclass(frozen=True, kw_only=True)
class SearchOptions(CommonOptions):
    """All options of a run that its result depends on: those that it records."""

    algorithm: str = field(
        default="auto",
        metadata=option(
            TEXT,
            "See 'bridgegen list algorithms'; auto, chosen by the budget; or your own: "
            "module:Class, file.py:Class.",
            group=SEARCH,
            names="algorithm",
        ),
    )
    settings: Mapping[str, Value] = field(
        default_factory=dict,
        metadata=option(
            SETTINGS,
            "Override a setting of the algorithm.",
            spelling="--set",
            hint="NAME=VALUE; may be repeated.",
            group=SEARCH,
            names="setting",
        ),
    )
    rate: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Also estimate how likely harm and each failure mode is; ends when that suffices.",
            before=False,
            group=SEARCH,
        ),
    )
    exposure: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "How parameters are distributed on the road, for --rate, which it implies: a file "
            "(.yaml), an example of 'bridgegen list exposures', or uniform.",
            shown="the scenario's; without one, the ranges",
            before=None,
            group=SEARCH,
        ),
    )
    budget: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Number of evaluations, exactly.",
            shown="1000, or a distribution's test runs",
            limits=(1, MAX_BUDGET),
            group=SEARCH,
        ),
    )
    seed: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Seed of all random numbers: the same seed gives the same result.",
            shown="0, or a distribution's",
            limits=(0, MAX_SEED),
            group=SEARCH,
        ),
    )
    ahead: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Evaluations in flight: propose new points before the last N results arrive, so that "
            "no worker waits for the slowest one.",
            hint="For slow simulators; the result depends on it.",
            shown="0",
            limits=(0, MAX_AHEAD),
            before=None,
            group=SEARCH,
        ),
    )
    keep: int = field(
        default=10,
        metadata=option(
            WHOLE,
            "Number of critical scenarios to export.",
            limits=(0, MAX_KEEP),
            group=OUTPUT,
        ),
    )
    triage: str = field(
        default="full",
        metadata=option(
            TEXT,
            "How much of the findings is simulated again, to test robustness and causes and to "
            "find minimal scenarios: full; short, about a third of it; or none.",
            hint="For slow drivers.",
            before="full",
            group=OUTPUT,
            names="triage",
        ),
    )
    repeats: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "How often findings of a search are evaluated again, at most, or each variation of a "
            "suite is run, if driver or simulator may not repeat: how likely each fails.",
            shown="1",
            limits=(1, MAX_REPEATS),
            before=None,
            group=OF_DRIVER,
        ),
    )
    simulator: SimulatorChoice = field(
        default=EMBEDDED,
        metadata=option(
            SIMULATOR,
            "Simulator that runs the scenarios.",
            before=EMBEDDED,
            group=OF_SIMULATOR,
            names="simulator",
        ),
    )
    screen: SimulatorChoice | None = field(
        default=None,
        metadata=option(
            SCREEN,
            "Cheap simulator (low fidelity) beside a slow one, in which the algorithm searches "
            "for what the simulator evaluates; with --rate, models learn what it is worth.",
            shown="none",
            before=None,
            group=OF_SIMULATOR,
            names="simulator",
        ),
    )
    screen_budget: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Number of evaluations in the screen, at most.",
            shown="20 for each evaluation; with --rate 100",
            limits=(1, MAX_BUDGET),
            before=None,
            group=OF_SIMULATOR,
        ),
    )
    screen_batch: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Number of evaluations that are chosen at a time, with a screen: a multiple of the "
            "number of workers keeps all of them busy; not with --rate.",
            shown="8",
            limits=(1, MAX_BUDGET),
            before=None,
            group=OF_SIMULATOR,
        ),
    )
    causes: bool = field(default=True, metadata=_CAUSES)
