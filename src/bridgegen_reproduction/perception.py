"""The paper's case for perception, put to the test with a driver that has to perceive.

Many generators of scenarios, the paper says, look at planning and control alone. So: of the
critical scenarios that a driver with sensors meets, how many vanish once it perceives ideally?
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from bridgegen.assess import cause
from bridgegen.assess.cause import Cause
from bridgegen.base.statistics import quartiles
from bridgegen_reproduction.numbers import number, share, spread
from bridgegen_reproduction.paper import METHODS, RS, TITLES
from bridgegen_reproduction.protocol import IDEAL, PERCEIVING, Protocol
from bridgegen_reproduction.runs import Runs, of
from bridgegen_reproduction.table import Table

CAUSES = tuple(item for item in cause.CAUSES if item is not Cause.VEHICLE_DYNAMICS)
"""The causes that there can be: the paper's vehicle is kinematic."""


@dataclass(frozen=True)
class Causes:
    """The critical scenarios of one method in one scenario, all seeds together.

    Attributes:
        scenario: name.
        algorithm: name.
        evaluations: all that were made.
        by_cause: how many critical ones have each cause, in the order of `CAUSES`.
        r_critic: of each run, by seed.
    """

    scenario: str
    algorithm: str
    evaluations: int
    by_cause: tuple[int, ...]
    r_critic: tuple[float, ...]

    @property
    def critical(self) -> int:
        """All critical ones."""
        return sum(self.by_cause)

    @property
    def vanish(self) -> int:
        """Those that are critical no more once the driver perceives ideally."""
        return self.by_cause[CAUSES.index(Cause.PERCEPTION)]


def causes_of(protocol: Protocol, runs: Runs) -> tuple[Causes, ...]:
    """Return the causes by scenario, in the paper's order, and method; those with a run only."""
    found = []
    for scenario in sorted(protocol.scenarios):
        for method in METHODS:
            these = of(runs, PERCEIVING, scenario, method.algorithm)
            if not these:
                continue
            counts = [sum(int((run.cause == c).sum()) for run in these) for c in CAUSES]
            found.append(
                Causes(
                    scenario,
                    method.algorithm,
                    sum(len(run.critical) for run in these),
                    tuple(counts),
                    tuple(float(run.critical.mean()) for run in these),
                )
            )
    return tuple(found)


def table_causes(found: Sequence[Causes]) -> Table:
    """Return how many critical scenarios vanish with ideal perception, and what the rest is."""
    rows, data = [], []
    names = [item.label for item in CAUSES]
    for causes in found:
        title = f"S{causes.scenario[-1]}"
        middle = quartiles(np.array(causes.r_critic))
        rows.append(
            (
                title,
                TITLES[causes.algorithm],
                spread(middle, 3, several=len(causes.r_critic) > 1),
                f"{causes.critical:,}",
                f"{causes.vanish:,}",
                share(causes.vanish, causes.critical),
                *(f"{count:,}" for count in causes.by_cause[1:]),
            )
        )
        data.append(
            (
                causes.scenario,
                causes.algorithm,
                len(causes.r_critic),
                causes.evaluations,
                causes.critical,
                middle.low,
                middle.median,
                middle.high,
                *causes.by_cause,
            )
        )
    head = (
        "scenario",
        "algorithm",
        "runs",
        "evaluations",
        "critical",
        "r_critic_q1",
        "r_critic_median",
        "r_critic_q3",
        *names,
    )
    return Table(
        "perception",
        "With the reference driver: critical scenarios that vanish with ideal perception",
        ("scenario", "method", "R_critic", "critical", "vanish", "share", *names[1:]),
        tuple(rows),
        (
            "Each critical scenario is replayed with one thing put right at a time; the first "
            "that helps is its cause: ideal perception (“vanish”); a careful driver who perceives "
            "ideally (planning); ideal control or a dry road (control); nothing (unavoidable). "
            "Counts are of all seeds together.",
            "A search returns to what it found: its critical scenarios are no sample of all that "
            "there are. That of RS is.",
        ),
        (head, *data),
        texts=2,
    )


@dataclass(frozen=True)
class Paired:
    """The same random scenarios, perceived by sensors and ideally.

    Attributes:
        scenario: name.
        evaluations: pairs.
        real: how many are critical with sensors.
        ideal: how many are with ideal perception.
        vanish: how many are with sensors only.
        appear: how many are with ideal perception only.
    """

    scenario: str
    evaluations: int
    real: int
    ideal: int
    vanish: int
    appear: int


def paired_of(protocol: Protocol, runs: Runs) -> tuple[Paired, ...]:
    """Return the pairs of random runs by scenario: what one seed draws is the same for both."""
    found = []
    for scenario in sorted(protocol.scenarios):
        both = [
            {run.folder.rpartition("/")[2]: run for run in of(runs, part, scenario, RS.algorithm)}
            for part in (PERCEIVING, IDEAL)
        ]
        names = [name for name in both[0] if name in both[1]]
        pairs = [(both[0][name], both[1][name]) for name in names]
        pairs = [(a, b) for a, b in pairs if np.array_equal(a.X, b.X)]
        if not pairs:
            continue
        real = np.concatenate([a.critical for a, _ in pairs])
        ideal = np.concatenate([b.critical for _, b in pairs])
        found.append(
            Paired(
                scenario,
                len(real),
                int(real.sum()),
                int(ideal.sum()),
                int((real & ~ideal).sum()),
                int((ideal & ~real).sum()),
            )
        )
    return tuple(found)


def table_paired(found: Sequence[Paired]) -> Table:
    """Return what ideal perception takes away of the random scenarios' harm, and what it adds."""
    rows = tuple(
        (
            f"S{paired.scenario[-1]}",
            f"{paired.evaluations:,}",
            f"{paired.real:,}",
            f"{paired.ideal:,}",
            f"{paired.vanish:,}",
            f"{paired.appear:,}",
            number(100.0 * (paired.ideal - paired.real) / paired.real, 0) + " %"
            if paired.real
            else "–",
        )
        for paired in found
    )
    return Table(
        "perception-paired",
        "The same random scenarios, once with sensors and once with ideal perception",
        (
            "scenario",
            "scenarios",
            "critical, sensors",
            "critical, ideal",
            "vanish",
            "appear",
            "change",
        ),
        rows,
        (
            "Ideal perception takes harm away and adds some: who sees farther drives faster, and "
            "who reacts otherwise meets the other somewhere else.",
        ),
        (
            ("scenario", "scenarios", "critical_sensors", "critical_ideal", "vanish", "appear"),
            *(astuple(paired) for paired in found),
        ),
    )
