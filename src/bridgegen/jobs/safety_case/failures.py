"""The failures of a run in its argument: none, or counter goals for each failure mode."""

from bridgegen.jobs.safety_case.builder import Draft
from bridgegen.jobs.safety_case.facts import MOST_SHOWN, Facts, Files
from bridgegen.jobs.safety_case.measured import way_of, ways
from bridgegen.jobs.safety_case.model import Condition
from bridgegen.jobs.safety_case.numbers import Numbers
from bridgegen.search.triage.record import Mode


class Part:
    """A part of a run's argument: what it is made of.

    Args:
        strategy: of the run's goal.
        facts: of the run.
        files: of the run.
        numbers: of the run.
    """

    def __init__(self, strategy: Draft, facts: Facts, files: Files, numbers: Numbers) -> None:
        self._strategy, self._at = strategy, strategy.at
        self._facts, self._files, self._numbers = facts, files, numbers
        self._ego = facts.ego

    def _n(self, name: str) -> str:
        """Return the place of a number in a template."""
        if name not in self._numbers:
            raise KeyError(name)
        return "{" + self._numbers.id(name) + "}"


class Failures(Part):
    """The goal that no failure was found."""

    def build(self) -> None:
        """Add the goal, and its support or what defeats it."""
        at, bound = f"{self._at}.3", self._facts.triage.bound
        if not bound.judged:
            why = "too few evaluations could be judged, or the scenario did not happen."
            self._strategy.add(
                "Goal",
                at,
                f"No failure of {self._ego} was found in {self._n('evaluations')} evaluations. The "
                f"run was not judged: {why}",
                undeveloped=True,
                link="failure-modes.md",
            )
            return
        besides = ""
        if self._facts.triage.fresh is not None:
            besides = f" or in {self._n('drawn')} fresh random draws besides"
        goal = self._strategy.add(
            "Goal",
            at,
            f"No failure of {self._ego} was found in {self._n('evaluations')} evaluations"
            f"{besides}.",
            holds=Condition(number=self._numbers.id("failures"), equals=0),
            link="failure-modes.md",
        )
        self._not_counted(goal, at)
        files = [self._files.run, self._files.triage]
        if not bound.harmful and not self._facts.fresh_harmful:
            goal.add(
                "Solution",
                f"{at}.1",
                f"All evaluations: {self._n('harmful')} failures.{self._margins()}",
                evidence=files,
            )
            return
        counter = goal.challenge(
            f"{self._n('failures')} failures of {self._ego} were found: {self._n('harmful')} of "
            f"{self._n('evaluations')} evaluations are harmful{self._kinds()}{self._drawn()}.",
            details=self._ways(),
        )
        counter.add(
            "CounterSolution",
            at,
            "All evaluations, their failure modes, and the draws.",
            evidence=files,
        )
        for mode in self._facts.triage.modes[:MOST_SHOWN]:
            self._mode(counter, mode)

    def _kinds(self) -> str:
        """Return how many failure modes there are, as a clause."""
        if "modes" not in self._numbers:
            return ""
        robust = (
            ", of them robust: " + self._n("robust_modes")
            if "robust_modes" in self._numbers
            else ""
        )
        return f" (failure modes: {self._n('modes')}{robust})"

    def _drawn(self) -> str:
        """Return how many fresh draws are failures, as a clause."""
        if not self._facts.fresh_harmful:
            return ""
        return f", and {self._n('drawn_harmful')} of {self._n('drawn_known')} fresh random draws"

    def _not_counted(self, goal: Draft, at: str) -> None:
        """Add what happened besides and does not count as a failure."""
        parts = []
        if "collisions" in self._numbers:
            parts.append(
                f"Evaluations with a collision of the ego, whoever is responsible: "
                f"{self._n('collisions')}."
            )
        if "not_preventable" in self._numbers:
            parts.append(
                f"In {self._n('not_preventable')} of them, in plausible traffic, the ego is "
                "neither responsible, nor would a careful driver have prevented it."
            )
        if "other_causes" in self._numbers:
            parts.append(
                f"Harmful evaluations with another root cause, which do not count: "
                f"{self._n('other_causes')}."
            )
        if parts:
            goal.add("Context", f"{at}.1", " ".join(parts), link="conflicts.md")

    def _margins(self) -> str:
        """Return the least margins reached, as a sentence."""
        names = {
            "harm": "harm {} of 0.3",
            "course_ttc": "{} s to collision",
            "course_braking": "{} m/s² needed",
        }
        parts = [
            words.format(self._n(f"least:{name}")) + f" (evaluation {self._n(f'least_at:{name}')})"
            for name, words in names.items()
            if f"least:{name}" in self._numbers
        ]
        return f" Nearest to harm: {', '.join(parts)}." if parts else ""

    def _ways(self) -> list[str]:
        """Return the failures by conflict, responsibility and rule, a line each."""
        triage = self._facts.triage
        found = [
            f"{self._n(f'way{k}')} × {conflict}, {sort}, responsible: {who}, rule: {rule}"
            for k, (conflict, sort, who, rule) in enumerate(ways(self._facts), start=1)
            if f"way{k}" in self._numbers
        ]
        rest = triage.modes[MOST_SHOWN:]
        return [
            *found,
            *(f"{self._n(f'count{m.number}')} × {self._n(f'title{m.number}')}" for m in rest),
        ]

    def _mode(self, counter: Draft, mode: Mode) -> None:
        at, k = f"{counter.at}.{mode.number}", mode.number
        near = "its neighbours were not simulated"
        if f"neighbours{k}" in self._numbers:
            word = "knife-edge" if mode.knife_edge else "robust"
            near = (
                f"{word}: {self._n(f'still_harmful{k}')} of {self._n(f'neighbours{k}')} neighbours"
            )
        check = self._facts.triage.step_check(mode.shown)
        if check is not None and not check.stable:
            near = f"{near}; its verdict depends on the time step"
        cause = f"; root cause: {mode.cause}" if mode.cause else ""
        draft = counter.add(
            "CounterGoal",
            at,
            f"{self._ego} {self._n(f'title{k}')}: {self._n(f'count{k}')} evaluations; "
            f"{near}{cause}.",
            details=[", ".join(way_of(mode))],
        )
        severity = ""
        if f"severity{k}" in self._numbers:
            severity = f", MAIS3+ {self._n(f'severity{k}')}"
        where = ""
        if f"simplest{k}" in self._numbers:
            where = f" Simplest form: {self._n(f'simplest{k}')}."
        draft.add(
            "CounterSolution",
            at,
            f"Evaluation {self._n(f'at{k}')}: harm {self._n(f'harm{k}')}{severity}.{where}",
            evidence=[self._files.run, *self._files.modes[k]],
        )
