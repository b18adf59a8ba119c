"""How much of a run's findings is simulated again: less for slow drivers."""

from collections.abc import Mapping
from dataclasses import dataclass

from bridgegen.base.errors import UnknownNameError


@dataclass(frozen=True)
class Effort:
    """What a triage tests, at most. Each test has 32 neighbours, whatever the effort.

    Attributes:
        per_mode: distinct worst rows of a mode among which a robust one is sought.
        spare: further rows among which robust ones to export are sought, for each exported one.
        placed: worst harmful rows that are simulated again to find their place on the route. Other
            rows get the place of the nearest of these with an otherwise equal key.
        tested: modes with a tested cause, besides those of the exported scenarios.
        minimal: modes with a minimal scenario.
        probes: of each minimal scenario, simulations that confirm its conditions.
        descends_robustly: whether a minimal scenario that is not robust is sought anew, by steps
            that each leave it robust.
        sampled: random harmful rows, besides the exported ones, whose neighbours are tested.
        fresh: random rows that estimate shares of the space if an algorithm chose the run's.
        finer: at which fractions of the time step findings are simulated again.
        unharmed: rows without failure, besides, that are.
    """

    per_mode: int
    spare: int
    placed: int
    tested: int
    minimal: int
    probes: int
    descends_robustly: bool
    sampled: int
    fresh: int
    finer: tuple[int, ...]
    unharmed: int

    @property
    def tests(self) -> bool:
        """Whether anything is simulated again."""
        return self.per_mode > 0


# A full triage simulates some 3,000 scenarios: seconds with our drivers, 20 minutes with a planner
# of 0.4 s each.
FULL = Effort(
    per_mode=3,
    spare=2,
    placed=4096,
    tested=20,
    minimal=10,
    probes=500,
    descends_robustly=True,
    sampled=8,
    fresh=256,
    # Of 62 verdicts of 3,147 findings that differ at a sixteenth of the step these show 60; a half
    # and a quarter showed 47 of another 61.
    finer=(2, 4, 8),
    unharmed=24,
)
# Fewer findings are tested, each as well as ever: 990 to 1,210 simulations in two measured runs.
SHORT = Effort(
    per_mode=1,
    spare=0,
    placed=64,
    tested=0,
    minimal=3,
    probes=250,
    descends_robustly=False,
    sampled=0,
    fresh=0,
    finer=(2,),
    unharmed=0,
)
NONE = Effort(
    per_mode=0,
    spare=0,
    placed=0,
    tested=0,
    minimal=0,
    probes=0,
    descends_robustly=False,
    sampled=0,
    fresh=0,
    finer=(),
    unharmed=0,
)
EFFORTS: Mapping[str, Effort] = {"full": FULL, "short": SHORT, "none": NONE}


def effort(name: str) -> Effort:
    """Return an effort.

    Raises:
        UnknownNameError: no such effort.
    """
    if name not in EFFORTS:
        raise UnknownNameError("triage", name, EFFORTS)
    return EFFORTS[name]
