"""What a repair can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from bridgegen.engine.options.forms import WHOLE
from bridgegen.engine.options.option import DRIVER, SEARCH, option
from bridgegen.engine.options.search import MAX_BUDGET
from bridgegen.jobs.frame import DRIVERS, Job
from bridgegen.jobs.suite.options import MAX_SAMPLES, ScenariosOptions


@dataclass(frozen=True, kw_only=True)
class RepairOptions(ScenariosOptions):
    """The options of ``repair_driver``."""

    egos: str | Sequence[str] = field(
        metadata=option(
            DRIVERS,
            "Driver to repair: a class, compiled function or planner with tunable numbers.",
            spelling="--ego",
            group=DRIVER,
            names="driver",
        ),
    )
    samples: int = field(
        default=2000,
        metadata=option(
            WHOLE,
            "Evenly spread variations of each scenario without a matrix that the repair does not "
            "see, on which both drivers are compared; as many random ones check settings before.",
            spelling="--held-out",
            limits=(1, MAX_SAMPLES),
            group=SEARCH,
        ),
    )
    budget: int = field(
        default=300,
        metadata=option(WHOLE, "Evaluations of each search.", limits=(1, MAX_BUDGET), group=SEARCH),
    )
    rounds: int = field(
        default=4,
        metadata=option(
            WHOLE,
            "Times that settings are sought and scenarios searched again, at most.",
            limits=(1, 100),
            group=SEARCH,
        ),
    )
    tries: int = field(
        default=120,
        metadata=option(
            WHOLE, "Settings that are tried in each round.", limits=(1, 100_000), group=SEARCH
        ),
    )


JOB = Job(
    name="repair",
    options=RepairOptions,
    function="bridgegen.jobs.repair.repair:repair_driver",
    help="""Set a driver's tunable numbers so that failures are gone.

    Searches, tunes with the least change while what has passed still passes, and searches again
    until nothing new is found. Writes the settings as a file that the driver reads, compares both
    on variations that it has not seen, and lists the failures that no setting mends.
    """,
    figures={
        "changed": "tunable numbers that are set anew",
        "failures": "failing scenarios that searches and random draws found, of all rounds",
        "mended": "of them, those that pass with the new settings",
        "structure": "those that none of the settings that were tried mends",
        "traded": "those that other settings mend, which break more or mend fewer",
        "late": "those of the last search, for which no settings were sought",
        "modes": "robust failure modes that the first search found",
        "modes_gone": "of them, those of which every recorded example passes",
        "broken": "held-out variations that pass without the settings, and fail with them",
        "fixed": "held-out variations that fail without them, and pass with them",
        "broken_robustly": "of the broken ones, those of which most neighbours fail with them, too",
        "both_fail": "held-out variations that fail with both",
        "fails_upper": "with 95 % confidence, at most this share of held-out variations fails",
        "jerk": "mean jerk with the settings / without",
        "travel_time": "travel time per distance with the settings / without",
    },
    example="broken > 0",
)
