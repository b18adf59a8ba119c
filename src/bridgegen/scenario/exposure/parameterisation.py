"""What a scenario's parameters leave out of recorded events: verdicts of replays and of twins."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from bridgegen.base.arrays import Bool
from bridgegen.base.errors import InputError
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent

VERDICTS = ("failure", "contact", "collision course")
"""The verdicts: a near miss or worse that the ego is responsible for or could prevent; bodies
touch; harm of a collision course at least. The first one that happens at all is stated."""
ELEMENTS = ("initial speed", "initial acceleration", "shape of braking", "lateral profile")
"""What of the recorded motion of the others is put back, one at a time."""

NOT_KNOWN = (
    "What its parameters leave out of recorded events is not known: 'bridgegen fit --recordings' "
    "counts it."
)
"""What is said of an exposure that was not compared."""

Shares = dict[str, tuple[float, float, float] | None]
"""Shares with the ends of their 95 % intervals; None of nothing."""


@dataclass(frozen=True)
class Agreement:
    """In how many events both replay and twin have a verdict, one alone, or neither."""

    both: int
    replay: int
    twin: int
    neither: int

    @classmethod
    def of(cls, replay: Bool, twin: Bool) -> "Agreement":
        """Count verdicts, ``(N,)`` each."""
        pairs = (replay & twin, replay & ~twin, ~replay & twin, ~replay & ~twin)
        return cls(*(int(pair.sum()) for pair in pairs))

    @property
    def changed(self) -> int:
        """In how many events the verdict differs."""
        return self.replay + self.twin

    @property
    def happens(self) -> int:
        """In how many events one of both has it."""
        return self.both + self.changed

    @property
    def events(self) -> int:
        """How many."""
        return self.happens + self.neither

    def shares(self) -> Shares:
        """Return recall and precision of the twins, F1, and the share of verdicts that change.

        With J the share of ``both`` in ``happens``, F1 is 2J/(1 + J), and so are its ends.
        """
        counts = {
            "recall": (self.both, self.both + self.replay),
            "precision": (self.both, self.both + self.twin),
            "f1": (self.both, self.happens),
            "changed": (self.changed, self.events),
        }
        found: Shares = {}
        for name, (k, n) in counts.items():
            ends = (k / n, *clopper_pearson(k, n)) if n else None
            if ends and name == "f1":
                ends = (*(2.0 * j / (1.0 + j) for j in ends),)  # type: ignore[assignment]
            found[name] = ends
        return found


@dataclass(frozen=True)
class Parameterisation:
    """How far the parameterised scenario is what was recorded.

    Attributes:
        source: the recordings, in words.
        events: that were simulated both ways with every driver.
        left_out: how many were not, by reason.
        agreement: by verdict and driver.
        given_back: by verdict and element, how many verdicts of all drivers still differ from the
            replay's where the twin has this element as it was recorded.

    Raises:
        InputError: counts that contradict each other.
    """

    source: str
    events: int
    left_out: Mapping[str, int]
    agreement: Mapping[str, Mapping[str, Agreement]]
    given_back: Mapping[str, Mapping[str, int]]

    def __post_init__(self) -> None:
        pairs = [one for of in self.agreement.values() for one in of.values()]
        counts = [n for one in pairs for n in asdict(one).values()] + [*self.left_out.values()]
        most = self.events * len(self.drivers)
        counts += [n for of in self.given_back.values() for n in of.values() if n > most or n < 0]
        if any(one.events != self.events for one in pairs) or any(
            not 0 <= n <= max(most, 10**9) for n in counts
        ):
            raise InputError(
                f"the counts of each driver must be at least 0 and have the sum events, "
                f"{self.events}, and given_back at most {most}"
            )

    @property
    def drivers(self) -> tuple[str, ...]:
        """Who drove."""
        return tuple(dict.fromkeys(name for of in self.agreement.values() for name in of))

    def pooled(self, verdict: str) -> Agreement:
        """Return the counts of all drivers together; they met the same events."""
        of = self.agreement.get(verdict, {}).values()
        return (
            Agreement(*map(sum, zip(*(asdict(one).values() for one in of), strict=True)))
            if of
            else Agreement(0, 0, 0, 0)
        )

    def sentence(self) -> str:
        """Return what the parameterisation alone changes, in one to three sentences."""
        return str(self.figures()["says"])

    def figures(self) -> dict[str, Any]:
        """Return what is stated, of all drivers together, as a result's file has it."""
        name = next((one for one in VERDICTS if self.pooled(one).happens), VERDICTS[0])
        pooled, back = self.pooled(name), self.given_back.get(name, {})
        shares = {key: None if s is None else s[0] for key, s in pooled.shares().items()}
        most = min(back, key=lambda element: back[element], default="")
        if not most or back[most] >= pooled.changed:
            most = ""
        drivers, n = ", ".join(self.drivers), pooled.events
        if not pooled.happens:
            says = (
                f"None of {self.events} recorded events leads to a {VERDICTS[-1]} or worse with "
                f"{drivers or 'a driver'}, replayed or parameterised: what the parameters leave "
                "out of recordings is not known."
            )
        else:
            first = "" if name == VERDICTS[0] else "No recorded event fails, either way. "
            share = percent(pooled.changed / n) if pooled.changed else "none"
            scores = [f"{shares[key]:.2f}" if shares[key] is not None else "not defined"
                      for key in ("recall", "precision", "f1")]  # fmt: skip
            says = (
                f"{first}The parameterisation alone changes {share} of the verdicts ({name}, "
                f"{pooled.changed} of {n}: {self.events} recorded events, {drivers}); "
                f"{pooled.happens} have it, recall {scores[0]}, precision {scores[1]}, F1 "
                f"{scores[2]}."
            )
            if most:
                left = percent(back[most] / n) if back[most] else "none"
                says += f" Leaving out the {most} costs most: given back, {left} change."
            elif pooled.changed:
                says += f" Giving back {' or '.join(ELEMENTS)} alone mends none."
        return {
            "events": self.events,
            "drivers": list(self.drivers),
            "verdict": name,
            **shares,
            "costs_most": most or None,
            "changed_with_it": back[most] / n if most else None,
            "says": says,
        }
