"""What a scenario's parameters leave out of recorded events: a block of its exposure."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.scenario.language.schema_types import ShapedSection, Text

VERDICTS = ("contact", "failure", "collision course")
"""The verdicts: bodies touch; a near miss or worse that the ego is responsible for or could
prevent; a collision course or worse, whoever is responsible. Stated is the one that changes most:
one that changes less must not hide it."""
ELEMENTS = ("initial speed", "initial acceleration", "shape of braking", "lateral profile")
"""What of the recorded motion of the others is put back, one at a time."""
NOT_KNOWN = (
    "What its parameters leave out of recorded events is not known: bridgegen fit --recordings "
    "counts it."
)
"""What is said of an exposure that was not compared."""

Count = Annotated[int, Field(strict=True, ge=0, le=10**9)]


class Agreement(ShapedSection):
    """Numbers of recorded events by the verdict of the replay and of its parameterised twin."""

    both: Count
    """Events in which replay and twin have the verdict."""
    replay: Count
    """Events in which the replay alone has it."""
    twin: Count
    """Events in which the twin alone has it."""
    neither: Count
    """Events in which neither has it."""

    @property
    def events(self) -> int:
        """How many."""
        return self.both + self.replay + self.twin + self.neither

    def shares(self) -> dict[str, tuple[float, float, float] | None]:
        """Return recall and precision of the twins, F1, and the share of verdicts that change.

        Each with the ends of its 95 % interval; None of nothing. With J the share of ``both`` in
        the events in which the verdict happens, F1 is 2J/(1 + J), and so are its ends.
        """
        changed = self.replay + self.twin
        counts = {
            "recall": (self.both, self.both + self.replay),
            "precision": (self.both, self.both + self.twin),
            "f1": (self.both, self.both + changed),
            "changed": (changed, self.events),
        }
        found: dict[str, tuple[float, float, float] | None] = {}
        for name, (k, n) in counts.items():
            j, low, high = (k / n, *clopper_pearson(k, n)) if n else (0.0, 0.0, 0.0)
            if name == "f1":
                j, low, high = (2.0 * end / (1.0 + end) for end in (j, low, high))
            found[name] = (j, low, high) if n else None
        return found


class Parameterisation(ShapedSection):
    """How verdicts of recorded events, replayed, agree with those of their parameterised twins."""

    source: Text
    """Recordings of the events."""
    events: Count
    """Number of events that were simulated both ways with each driver."""
    left_out: dict[Text, Count] = Field(default={})
    """Numbers of events that were not, by reason."""
    agreement: Annotated[dict[Text, dict[Text, Agreement]], Field(max_length=len(VERDICTS))]
    """Counts by verdict and driver."""
    given_back: dict[Text, dict[Text, Count]] = Field(default={})
    """Number of verdicts of all drivers that differ from the replay's if the twin has one thing as
    it was recorded, by verdict and thing."""

    @model_validator(mode="after")
    def _fit(self) -> Self:
        known = {*self.agreement, *self.given_back} <= {*VERDICTS}
        pairs = [one for of in self.agreement.values() for one in of.values()]
        if not known or any(one.events != self.events for one in pairs):
            rule = "must have counts with the sum events for each driver, of {verdicts}"
            raise PydanticCustomError("counts", rule, {"verdicts": ", ".join(VERDICTS)})
        return self

    @property
    def drivers(self) -> list[str]:
        """Who drove."""
        return [*dict.fromkeys(name for of in self.agreement.values() for name in of)]

    def pooled(self, verdict: str) -> Agreement:
        """Return the counts of all drivers together; they met the same events."""
        of = self.agreement.get(verdict, {}).values()
        names = Agreement.model_fields
        return Agreement(**{name: sum(getattr(one, name) for one in of) for name in names})

    def figures(self) -> dict[str, Any]:
        """Return what is stated, of all drivers together, as a result's file has it.

        ``says`` is it in one to three sentences.
        """

        def weight(verdict: str) -> tuple[int, bool]:
            of = self.pooled(verdict)
            return of.replay + of.twin, of.both > 0

        name = max(VERDICTS, key=weight)
        pooled, back = self.pooled(name), self.given_back.get(name, {})
        shares = {key: one and one[0] for key, one in pooled.shares().items()}
        n, changed = pooled.events, pooled.replay + pooled.twin
        most = min(back, key=lambda element: back[element], default="")
        most = most if most and back[most] < changed else ""
        drivers, happens = ", ".join(self.drivers), pooled.both + changed
        if not happens:
            says = (
                f"None of {self.events} recorded events leads to a collision course or worse, "
                "replayed or parameterised: what the parameters leave out of them is not known."
            )
        else:
            fails = self.pooled("failure")
            says = "" if fails.events > fails.neither else "No recorded event fails, either way. "
            scores = ", ".join(
                f"{words} {'not defined' if shares[key] is None else format(shares[key], '.2f')}"
                for key, words in (("recall", "recall"), ("precision", "precision"), ("f1", "F1"))
            )
            says += (
                "The parameterisation alone changes "
                f"{percent(changed / n) if changed else 'none'} of the verdicts ({name}, {changed} "
                f"of {n}: {self.events} recorded events, {drivers}); {happens} have it, {scores}."
            )
            if most:
                says += f" Leaving out the {most} costs most: given back, {back[most]} change."
            elif changed and back:
                says += f" Giving back {' or '.join(back)} alone mends none."
            elif not changed:
                high = clopper_pearson(0, self.events)[1]
                says += f" With 95 % confidence it changes less than {percent(high)} of them."
        return {
            "events": self.events,
            "drivers": self.drivers,
            "verdict": name,
            **shares,
            "costs_most": most or None,
            "changed_with_it": back[most] / n if most else None,
            "says": says,
        }
