"""What a risk can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.engine.options.forms import ANOTHER_SIMULATOR, FLAG, NUMBER, PATH, TEXT, WHOLE
from bridgegen.engine.options.option import DRIVER, OUTPUT, SIMULATOR, WHAT, option
from bridgegen.jobs.frame import (
    ANY,
    EXPOSURES,
    SCENARIOS,
    DriveOptions,
    Job,
    SimulatingOptions,
)

if TYPE_CHECKING:
    from bridgegen.scenario.exposure import Exposure
    from bridgegen.scenario.exposure.fit import Fit
    from bridgegen.simulation.choice import SimulatorChoice

WORDS = {
    "conflict": "a near miss or a collision",
    "collision": "a collision",
    "mais3": "a collision with a serious injury (MAIS3+)",
}
"""Quantities whose probability is stated, in words: the events, and a serious injury."""


@dataclass(frozen=True, kw_only=True)
class RiskOptions(DriveOptions, SimulatingOptions):
    """The options of ``estimate_risk``."""

    scenario: str | Path | Sequence[str | Path] = field(
        default=(),
        kw_only=False,
        metadata=option(
            SCENARIOS,
            "A name of the catalogue or of a pack, or a YAML file; several, or a folder: their "
            "rates are added.",
            names="suite",
            group=WHAT,
            is_argument=True,
        ),
    )
    every: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Add the rates of all scenarios of the catalogue.",
            spelling="--catalogue",
            group=WHAT,
        ),
    )
    ego: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Driver under test.",
            shown="the scenario's choice",
            group=DRIVER,
            names="driver",
        ),
    )
    exposure: "str | Path | Exposure | Sequence[str | Path | Exposure]" = field(
        default=(),
        metadata=option(
            EXPOSURES,
            "How its parameters are distributed: a file (.yaml), an example of 'bridgegen list "
            "exposures', or uniform.",
            hint="May be repeated: one for each scenario.",
            shown="the exposure in the scenario's file",
        ),
    )
    event: str = field(
        default="collision",
        metadata=option(TEXT, "Event whose probability is estimated: conflict or collision."),
    )
    count: str = field(
        default="ego",
        metadata=option(
            TEXT, "Conflicts that count: ego (it is responsible, or could prevent them), or any."
        ),
    )
    method: str = field(
        default="auto",
        metadata=option(TEXT, "Method of estimation: auto, mc, subset, importance or stratified."),
    )
    precision: float = field(
        default=0.2,
        metadata=option(
            NUMBER,
            "Stop when the 95 % interval's half-width is below this fraction of the estimate; "
            "0: never.",
        ),
    )
    budget: int = field(
        default=200_000,
        metadata=option(
            WHOLE,
            "Maximum number of simulations of the estimate, of all scenarios; a tenth more search "
            "for the most likely harmful ones.",
        ),
    )
    seed: int = field(default=0, metadata=option(WHOLE, "Seed of the random number generator."))
    start: str | Path | None = field(
        default=None,
        metadata=option(
            PATH,
            "Run of a search, whose harmful scenarios importance sampling may use.",
            spelling="--from",
        ),
    )
    check: int = field(
        default=0,
        metadata=option(
            WHOLE,
            "Number of plain Monte Carlo simulations for a second estimate, to compare.",
            shown="none",
        ),
    )
    events: "str | Path | Fit | None" = field(
        default=None,
        metadata=option(
            ANY,
            "Table (.csv) that the exposure was fitted to: adds the sampling uncertainty of the "
            "fitted exposure (bootstrap).",
            shown="none",
        ),
    )
    simulator: "SimulatorChoice | None" = field(
        default=None,
        metadata=option(
            ANOTHER_SIMULATOR,
            "Also simulate rows around the harmful ones in this simulator, and state the factor by "
            "which the event is more or less likely there.",
            shown="none",
            group=SIMULATOR,
            names="simulator",
        ),
    )
    simulator_rows: int = field(
        default=200,
        metadata=option(WHOLE, "Number of rows simulated in the other simulator.", group=SIMULATOR),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "The risk's folder; a stopped estimate is resumed.",
            shown="risk/SCENARIO, risk/total",
            group=OUTPUT,
        ),
    )


_OF = {"": "probability of {} per encounter", "_upper": "it is below this, with 95 % confidence"}
FIGURES = {
    **{
        f"{name}{end}": text.format(words)
        for name, words in WORDS.items()
        for end, text in _OF.items()
    },
    **{f"{name}_per_hour": f"{words}, per hour" for name, words in WORDS.items()},
    **{f"{name}_per_km": f"{words}, per km" for name, words in WORDS.items()},
    **{
        f"{name}_per_{unit}_upper": f"{words}, per {unit}: it is below this, with 95 % confidence"
        for name, words in WORDS.items()
        for unit in ("hour", "km")
    },
    "evaluations": "simulations",
}
"""The figures of a risk that ``--fail-if`` accepts."""

JOB = Job(
    name="risk",
    options=RiskOptions,
    function="bridgegen.jobs.risk.total:estimate_any_risk",
    help="""Estimate how likely harm is per encounter, with an interval.

    And per hour and kilometre, where the exposure says how often the scenario is met; of several
    scenarios, the sum. Writes a record, a page, the harmful rows, and the most likely one of each
    failure mode as a scenario.
    """,
    figures=FIGURES,
    example="collision_upper > 1e-4",
)
