"""The argument of one run: what it supports, and what speaks against it, goal by goal."""

from bridgegen.assess.criteria import CriterionSummary
from bridgegen.jobs.safety_case.builder import Draft
from bridgegen.jobs.safety_case.facts import BINS
from bridgegen.jobs.safety_case.failures import Failures, Part
from bridgegen.jobs.safety_case.model import Condition
from bridgegen.search.triage.record import NOT_JUDGED


class RunArgument(Part):
    """The goals of one run, below its strategy."""

    def build(self) -> None:
        """Add all goals."""
        self._scope()
        self._coverage()
        Failures(self._strategy, self._facts, self._files, self._numbers).build()
        self._space()
        self._requirements()
        self._simulator()
        self._strategy.add(
            "Goal",
            f"{self._at}.7",
            "The harmful share that may remain is acceptable in the operational design domain. "
            "This needs exposure and an acceptance criterion, which a run does not have.",
            undeveloped=True,
            link="limits.md#sotif-un-r157-euro-ncap",
        )

    def _scope(self) -> None:
        goal = self._strategy.add(
            "Goal",
            f"{self._at}.1",
            f"The search ended: {self._n('evaluations')} concrete scenarios of "
            f"{self._facts.scenario.name} were evaluated, and each has a result "
            f"({self._n('failed')} have none).",
            holds=Condition(number=self._numbers.id("failed"), equals=0),
        )
        if "d_min" in self._numbers:
            least = f"; the smallest distance to another participant is {self._n('d_min')} m"
        else:
            least = ""
        goal.add(
            "Solution",
            f"{self._at}.1.1",
            f"All evaluations: {self._n('critical')} are critical by the run's own rule, "
            f"{self._n('implausible')} have implausible traffic and count neither way{least}.",
            evidence=[self._files.run, *self._files.inputs],
        )

    def _coverage(self) -> None:
        at = f"{self._at}.2"
        if "bins_all" not in self._numbers:
            self._strategy.add(
                "Goal",
                at,
                "The searched parameters are covered; none was searched.",
                undeveloped=True,
                link="read-a-report.md",
            )
            return
        goal = self._strategy.add(
            "Goal",
            at,
            f"All feasible bins of the searched parameters were evaluated: "
            f"{self._n('bins_evaluated')} of {self._n('bins_feasible')}.",
            holds=Condition(
                number=self._numbers.id("bins_evaluated"),
                equals=self._numbers.id("bins_feasible"),
            ),
        )
        goal.add(
            "Context",
            f"{at}.1",
            f"Bins: {BINS} equal parts of each declared range; one for each whole number or "
            "category. Feasible: met by a random sample or by the run, a lower bound.",
        )
        pairs = ""
        if "pairs_all" in self._numbers:
            pairs = (
                f" Of pairs of bins {self._n('pairs_evaluated')} of {self._n('pairs_feasible')} "
                "feasible ones were evaluated."
            )
        goal.add(
            "Solution",
            f"{at}.1",
            f"Coverage of the space: {self._n('bins_all')} bins.{pairs}",
            details=[self._bins(k) for k in range(len(self._facts.coverage.parameters))],
            evidence=[self._files.run],
        )

    def _bins(self, k: int) -> str:
        parameter = self._facts.coverage.parameters[k]
        counts = zip(parameter.evaluated.tolist(), parameter.feasible.tolist(), strict=True)
        cells = ", ".join(str(n) if there else "not feasible" for n, there in counts)
        return f"{parameter.name} ({parameter.span}): {cells}"

    def _space(self) -> None:
        at, space = f"{self._at}.4", self._facts.triage.bound.space
        if not self._facts.triage.bound.judged:
            self._strategy.add(
                "Goal",
                at,
                "The harmful share of the searched space is bounded. The run was not judged, so "
                "its rows bound nothing.",
                undeveloped=True,
                link="failure-modes.md",
            )
            return
        if "share" not in self._numbers:
            self._strategy.add(
                "Goal",
                at,
                "The harmful share of the searched space is bounded. It was not estimated: the "
                "search chose its rows, and no fresh random ones were simulated.",
                undeveloped=True,
                link="failure-modes.md",
            )
            return
        interval = (
            f"between {self._n('share_low')} and {self._n('share_high')}"
            if space.harmful
            else f"at most {self._n('share_high')}"
        )
        goal = self._strategy.add(
            "Goal",
            at,
            f"With 95 % confidence {interval} of the searched space is harmful (by the declared "
            "parameters, not weighted by exposure).",
            link="failure-modes.md",
        )
        rows = {
            "random": "the run's own random rows",
            "sobol": "the run's own Sobol points",
            "fresh": "fresh random rows, besides those that the search chose",
        }[space.drawn]
        goal.add(
            "Assumption",
            f"{at}.1",
            "Draws are independent and as the scenario declares: "
            f"{'by its prior or uniform' if space.met else 'uniform'} over each parameter's "
            "range, as far as the constraints leave it, one parameter after the other. Draws "
            "without a result, or with implausible traffic, count neither way."
            + (" Sobol points are taken for independent draws." if space.drawn == "sobol" else ""),
        )
        goal.add(
            "Justification",
            f"{at}.1",
            "The interval is exact (Clopper and Pearson 1934, two-sided): whatever the true "
            "share, it is missed in at most 1 of 20 runs.",
        )
        goal.add(
            "Solution",
            f"{at}.1",
            f"{self._n('drawn_harmful')} of {self._n('drawn_known')} draws with a result are "
            f"harmful ({self._n('share')}); {self._n('drawn')} were drawn: {rows}.",
            # Fresh rows are no evaluations of the run: they are in the triage's record.
            evidence=[self._files.triage if space.drawn == "fresh" else self._files.run],
        )

    def _requirements(self) -> None:
        at, criteria = f"{self._at}.5", self._facts.run.criteria
        if not criteria:
            self._strategy.add(
                "Goal",
                at,
                f"{self._ego} meets its requirements. None was stated.",
                undeveloped=True,
                link="criteria.md",
            )
            return
        goal = self._strategy.add(
            "Goal",
            at,
            f"{self._ego} meets each of {len(criteria)} stated requirements in every evaluation."
            if len(criteria) > 1
            else f"{self._ego} meets its stated requirement in every evaluation.",
            link="criteria.md",
        )
        strategy = goal.add("Strategy", at, "Argument over each requirement.")
        for k, criterion in enumerate(criteria, start=1):
            self._requirement(strategy, f"{at}.{k}", criterion)

    def _requirement(self, above: Draft, at: str, criterion_summary: CriterionSummary) -> None:
        name = criterion_summary.criterion.id
        words = (
            f" ({criterion_summary.criterion.text.rstrip('.')})"
            if criterion_summary.criterion.text
            else ""
        )
        known = (
            bool(criterion_summary.met + criterion_summary.violated)
            and self._facts.run.verdict != NOT_JUDGED
        )
        goal = above.add(
            "Goal",
            at,
            f"{name}{words} is met in every evaluation with a result: "
            f"{criterion_summary.criterion.states}"
            + ("" if known else ". The run was not judged, so its evaluations do not support it."),
            holds=Condition(number=self._numbers.id(f"violated:{name}"), equals=0),
            details=[f"severity of a violation: {criterion_summary.criterion.severity}"],
            undeveloped=not known,
        )
        if not known:
            return
        least = ""
        if f"worst:{name}" in self._numbers:
            unit = "" if criterion_summary.unit == "1" else f" {criterion_summary.unit}"
            least = (
                f"; least margin {self._n(f'worst:{name}')}{unit} "
                f"(evaluation {self._n(f'worst_at:{name}')})"
            )
        facts = (
            f"Met in {self._n(f'met:{name}')} evaluations, violated in "
            f"{self._n(f'violated:{name}')}, unknown in {self._n(f'unknown:{name}')}{least}."
        )
        if criterion_summary.violated:
            counter = goal.challenge(
                f"{self._ego} violates {name} in {self._n(f'violated:{name}')} evaluations."
            )
            counter.add("CounterSolution", at, facts, evidence=[self._files.run])
        else:
            goal.add("Solution", at, facts, evidence=[self._files.run])

    def _simulator(self) -> None:
        at = f"{self._at}.6"
        goal = self._strategy.add(
            "Goal",
            at,
            "The simulation is valid for the vehicle and the domain.",
            link="limits.md",
        )
        strategy = goal.add(
            "Strategy", at, "Argument over what it finds, and over what it may miss."
        )
        confirmed = strategy.add(
            "Goal",
            f"{at}.1",
            "Failures that it finds are found in another simulator, too.",
            undeveloped=not self._files.confirmations,
            link="confirm.md",
        )
        for k, (name, file) in enumerate(self._files.confirmations.items(), start=1):
            ran = self._numbers[f"ran:{name}"].value
            draft = confirmed.add(
                "Goal",
                f"{at}.1.{k}",
                f"In {name} each scenario that ran is critical, too: "
                f"{self._n(f'confirmed:{name}')} of {self._n(f'ran:{name}')}.",
                holds=Condition(
                    number=self._numbers.id(f"confirmed:{name}"),
                    equals=self._numbers.id(f"ran:{name}"),
                ),
                # No scenario ran there: "0 of 0" would hold, and support nothing.
                undeveloped=not ran,
            )
            if ran:
                draft.add("Solution", f"{at}.1.{k}", f"Confirmation in {name}.", evidence=[file])
        strategy.add(
            "Goal",
            f"{at}.2",
            "It misses no failure that the vehicle has. No result was compared with a vehicle.",
            undeveloped=True,
            link="limits.md#other-simulators",
        )
