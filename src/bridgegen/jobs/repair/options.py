"""What a repair can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from bridgegen.engine.options.forms import NUMBER, TEXT, WHOLE
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
            "Driver to repair: a class, compiled function or planner that declares tunable "
            "numbers.",
            spelling="--ego",
            group=DRIVER,
            names="driver",
        ),
    )
    matrix: str | None = field(
        default="none",
        metadata=option(
            TEXT,
            "Hold an edition of the scenarios' matrices out instead of --held-out variations.",
            group=SEARCH,
        ),
    )
    samples: int = field(
        default=2000,
        metadata=option(
            WHOLE,
            "Evenly spread variations of each scenario that the repair does not see, on which the "
            "driver is compared with the repaired one.",
            spelling="--held-out",
            limits=(1, MAX_SAMPLES),
            group=SEARCH,
        ),
    )
    budget: int = field(
        default=300,
        metadata=option(
            WHOLE,
            "Evaluations of each search of a scenario for failures.",
            limits=(1, MAX_BUDGET),
            group=SEARCH,
        ),
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
    within: float = field(
        default=0.05,
        metadata=option(
            NUMBER,
            "Share by which mean jerk and travel time may grow where the driver has passed.",
            limits=(0.0, 10.0),
            group=SEARCH,
        ),
    )
    seed: int = field(
        default=0,
        metadata=option(WHOLE, "Seed of searches, settings and variations.", group=SEARCH),
    )


JOB = Job(
    name="repair",
    options=RepairOptions,
    function="bridgegen.jobs.repair.repair:repair_driver",
    help="""Set a driver's tunable numbers so that the failures that a search finds are gone.

    Searches, tunes with the least change while what has passed still passes, and searches again
    until nothing new is found. Writes the settings as a file that the driver reads, compares both
    on variations that it has not seen, and lists the failures that no setting mends.
    """,
    figures={
        "changed": "tunable numbers that are set anew",
        "failures": "failing scenarios that searches found, of all rounds",
        "mended": "of them, those that pass with the new settings",
        "left": "of them, those that fail with them, too",
        "structure": "of these, those that no setting mends that was tried",
        "new": "scenarios that pass without the settings, and of which a search found that they "
        "fail with them",
        "late": "of those that are left, those that the last search found: no settings were sought",
        "traded": "of them, those that other settings mend, which break more or mend fewer",
        "modes": "robust failure modes that the first search found",
        "modes_gone": "of them, those of which every recorded example passes",
        "broken": "held-out variations that pass without the settings, and fail with them",
        "fixed": "held-out variations that fail without them, and pass with them",
        "both_fail": "held-out variations that fail with both",
        "fails_upper": "with 95 % confidence, at most this share of held-out variations fails with "
        "the settings",
        "jerk": "mean jerk with the settings / without",
        "travel_time": "travel time per distance with the settings / without",
    },
    example="broken > 0",
)
