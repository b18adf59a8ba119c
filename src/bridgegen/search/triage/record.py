"""The triage of a run as ``triage.json`` in its folder: written from these models, checked by them.

Every list has a limit, so that the size of the record does not depend on the length of the run.
"""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model
from bridgegen.base.statistics import beta_binomial, confidence_sequence

JSON_FILE = "triage.json"
"""File of the triage's record in a run's folder."""

MOST_MODES = 50
"""Largest number of failure modes that are recorded; those that hold the most harmful rows."""

MOST_EXAMPLES = 20
"""Largest number of evaluations that are named of a mode, worst first."""

MOST_NEIGHBOURHOODS = 2000

Number = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Change = Annotated[float, Field(ge=-1.0, le=1.0)]
Amount = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=10**8)]
Text = Annotated[str, Field(max_length=2000)]
Drawn = Literal["random", "sobol", "fresh", ""]
"""Origin of the rows from which a share is estimated: the run's own, drawn at random or from a
Sobol sequence; fresh random ones; "" where there are none and nothing is estimated."""

Verdict = Literal["fails", "no failure found", "not judged"]
"""Verdict of a run on its driver."""
NOT_JUDGED: Verdict = "not judged"

CauseLabel = Literal[
    "perception",
    "planning",
    "vehicle dynamics",
    "control",
    "unavoidable",
    "sensitive",
    "not known",
    "",
]
"""Labels of `bridgegen.assess.cause.Cause`; "sensitive": a small change of the parameters alone
makes most of the harm vanish, so that no fix can be credited; "not known": too few neighbours have
a result with some fix; "" where none was tried."""


Met = bool | Literal["within"]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Estimate(_Model):
    """A share of the search space, estimated from rows that no algorithm chose.

    Attributes:
        drawn: the source of the rows.
        rows: that have a result.
        harmful: of them.
        share: harmful / rows; None where there are no rows.
        low: lower end of the two-sided 95 % Clopper-Pearson interval.
        high: its upper end, also where no row is harmful: a one-sided 97.5 % upper bound.
        met: whether parameters were drawn as often as their priors say, or in a part of what these
            span ("within"); else all evenly.
    """

    drawn: Drawn
    rows: Count
    harmful: Count
    share: Share | None
    low: Share
    high: Share
    met: Met = False

    @property
    def measure(self) -> str:
        """By which measure of the space, in words."""
        if not self.met:
            return "uniform over the ranges"
        within = " within its ranges" if self.met == "within" else ""
        return f"weather as it is met{within}, all else uniform"


class FreshRows(_Model):
    """The fresh random rows that shares of the space are estimated from, in their order.

    Attributes:
        harm: of each; None of one without a result, or with implausible traffic.
        mode: the number of the failure mode that each is of; 0 of no recorded one.
    """

    harm: Annotated[tuple[Share | None, ...], Field(max_length=10_000)]
    mode: Annotated[tuple[Count, ...], Field(max_length=10_000)]

    @property
    def failures(self) -> list[int]:
        """The mode of each harmful one."""
        pairs = zip(self.harm, self.mode, strict=True)
        return [mode for harm, mode in pairs if harm is not None and harm >= NEAR_MISS]


class Frequency(_Model):
    """How likely an event is: on the road, or in the ranges.

    Attributes:
        estimate: the probability; None where its interval is not believed.
        low: lower end of the 95 % interval.
        high: its upper end; where there is no estimate, of what rows say that were drawn as on the
            road.
        hits: effective number of failures behind it.
        doubt: why there is no estimate; "" where there is one.
    """

    estimate: Share | None
    low: Share
    high: Share
    hits: Amount
    doubt: Text = ""

    @property
    def sentence(self) -> str:
        """In words: "2.1e-4 (95 %: 1.6e-4 to 3.9e-4)"."""
        if self.estimate is None:
            return f"at most {self.high:.2g} (95 %); not estimated: {self.doubt}"
        if not self.estimate:
            return f"at most {self.high:.2g} (95 %)"
        return f"{self.estimate:.2g} (95 %: {self.low:.2g} to {self.high:.2g})"


class PerAmount(_Model):
    """How often harm happens on the road, in an amount of driving.

    Attributes:
        unit: the amount: "hour" or "1,000 km".
        estimate: how often; None where the probability of harm is not estimated.
        low: lower end of the 95 % interval.
        high: its upper end.
    """

    unit: Literal["hour", "1,000 km"]
    estimate: Amount | None
    low: Amount
    high: Amount

    @property
    def sentence(self) -> str:
        """In words: "0.21 per hour (95 %: 0.16 to 0.39)"."""
        if not self.estimate:
            return f"at most {self.high:.2g} per {self.unit} (95 %)"
        return f"{self.estimate:.2g} per {self.unit} (95 %: {self.low:.2g} to {self.high:.2g})"


class Rate(_Model):
    """How likely harm is, from the rows of a search that were drawn with known chances.

    Attributes:
        harm: the probability of harm.
        source: of the exposure; "" where rows stand for the ranges.
        met: whether weather is as it is met, without an exposure.
        rows: that were drawn, repeated ones included.
        road: of them, how many were drawn as on the road.
        per: how often harm happens, where the exposure says how often the scenario is met.
        left: evaluations of the budget that were not needed: what was found sufficed.
    """

    harm: Frequency
    source: Text
    met: bool
    rows: Count
    road: Amount
    per: Annotated[tuple[PerAmount, ...], Field(max_length=2)] = ()
    left: Count = 0

    @property
    def sentence(self) -> str:
        """In words, with what it is a probability of."""
        if self.source:
            of = f"per encounter, by the exposure: {self.source.rstrip('.')}"
        else:
            even = "weather as it is met, all else uniform" if self.met else "uniform"
            of = f"of the ranges ({even}; not a rate on roads: no exposure is given)"
        often = f"; {', '.join(amount.sentence for amount in self.per)}" if self.per else ""
        early = f"; {self.left:,} evaluations were not needed" if self.left else ""
        return f"P(harm) {self.harm.sentence}, {of}{often}{early}"


class Treatment(_Model):
    """What one change made of the neighbours of a row; each neighbour is its own comparison.

    Attributes:
        name: "perception is ideal", "un-r157 drives", "the road is dry", …; "random move" is the
            placebo.
        cause: that the change stands for; "" for the placebo.
        rows: neighbours that have a result with and without the change. Where the change removes
            the conflict, harmless up to its time is enough: what would follow is gone.
        before: of them, those that are harmful unchanged; None in records of earlier versions.
        gone: neighbours that are harmful unchanged and harmless with the change.
        new: neighbours that are harmless unchanged and harmful with the change.
        drop: (gone - new) / rows.
        low: lower end of its 95 % interval (Newcombe 1998, paired proportions, method 10).
        high: its upper end.
    """

    name: Text
    cause: CauseLabel
    rows: Count
    gone: Count
    new: Count
    drop: Change
    low: Change
    high: Change
    before: Count | None = None

    @property
    def works(self) -> bool:
        """Whether the drop is significantly above zero."""
        return self.low > 0.0

    def exceeds(self, placebo: "Treatment") -> bool:
        """Whether it helps more neighbours than a placebo, and lowers the share by more."""
        return self.gone > placebo.gone and self.drop > placebo.drop


class Neighbourhood(_Model):
    """The results of the neighbours of one row.

    Attributes:
        evaluation: the row's id in the store.
        rows: neighbours that have a result.
        harmful: of them, unchanged.
        robustness: harmful / rows; None where no neighbour has a result.
        low: lower end of its 95 % interval (Wilson).
        high: its upper end.
        cause: the first fix whose drop is significantly above zero and exceeds the placebo's;
            "unavoidable" where no fix has one; "not known" where fewer than half of the neighbours
            have a result with some fix; "sensitive" of a knife-edge row; "" where no fix was tried.
        fixes: in the order in which causes are sought; empty where they were not tried.
        placebo: one more random move of the same size for each neighbour.
        sampled: whether the row was drawn at random from those that are not exported.
        judgement: what caused it, and what would have avoided it, in one clause; "" where no fix
            was tried, and in records of earlier versions.
    """

    evaluation: Count
    rows: Count
    harmful: Count
    robustness: Share | None
    low: Share
    high: Share
    cause: CauseLabel = ""
    fixes: Annotated[tuple[Treatment, ...], Field(max_length=20)] = ()
    placebo: Treatment | None = None
    sampled: bool = False
    judgement: Text = ""

    @property
    def knife_edge(self) -> bool:
        """Whether fewer than half of the neighbours are harmful."""
        return self.robustness is not None and self.robustness < 0.5

    @property
    def fix(self) -> Treatment | None:
        """The fix that the cause was found by, if one was."""
        if self.placebo is None or self.cause in ("sensitive", "unavoidable", "not known", ""):
            return None
        works = (
            treatment
            for treatment in self.fixes
            if treatment.works and treatment.exceeds(self.placebo)
        )
        return next(works, None)


class AtStep(_Model):
    """What becomes of an evaluation at a fraction of the time step.

    Attributes:
        steps: how many make one of the scenario's.
        ok: whether it has a result, with plausible traffic.
        harmful: whether it is a failure.
        harm: 0 where there is no result.
        severity: probability of MAIS3+ in the ego's collision.
        time: of the decisive conflict [s]; None where there is none, like the next two.
        place: of the ego's front in that conflict [m].
        speed: of the ego then [m/s].
        conflict: its kind; "" where there is none.
    """

    steps: Annotated[int, Field(ge=1, le=1000)]
    ok: bool
    harmful: bool
    harm: Share
    severity: Share
    time: Number | None = None
    place: tuple[Number, Number] | None = None
    speed: Number | None = None
    conflict: Text = ""


class StepCheck(_Model):
    """An evaluation at the scenario's time step and at fractions of it.

    Attributes:
        evaluation: its number.
        time_step: the scenario's [s].
        at: the results, at the scenario's step first.
    """

    evaluation: Count
    time_step: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    at: Annotated[tuple[AtStep, ...], Field(min_length=1, max_length=10)]

    @property
    def stable(self) -> bool:
        """Whether verdict and kind of conflict are the same at each step."""
        same = {(one.ok, one.harmful, one.conflict if one.harmful else "") for one in self.at}
        return len(same) == 1

    @property
    def sentence(self) -> str:
        """The check in words; "" where it shows nothing to be said."""
        first, *finer = self.at
        if self.stable or not finer:
            return ""
        other = next(
            one
            for one in finer
            if (one.ok, one.harmful, one.conflict) != (first.ok, first.harmful, first.conflict)
        )
        return (
            f"depends on the time step: {_kind(first)} at {self.time_step:g} s, {_kind(other)} at "
            f"{self.time_step / other.steps:g} s"
        )


class Repeated(_Model):
    """An evaluation that was made again, as the driver or the simulator may not repeat.

    Attributes:
        evaluation: its number.
        failed: whether it did. It was chosen for that, so it is not counted itself.
        repeats: further evaluations that have a verdict.
        fails: of them.
        lost: further ones without a result, or with implausible traffic.
        mode: number of the failure mode that it is of; 0 of none.
    """

    evaluation: Count
    failed: bool = False
    repeats: Count = 0
    fails: Count = 0
    lost: Count = 0
    mode: Count = 0

    @property
    def probability(self) -> float:
        """P(fail | scenario): the mean of what the repeats leave of an even prior."""
        return (self.fails + 1.0) / (self.repeats + 2.0)

    @property
    def agrees(self) -> bool:
        """Whether all repeats have the verdict of the first evaluation."""
        return self.fails == self.repeats * self.failed

    @property
    def sentence(self) -> str:
        """The result in words."""
        lost = f", {self.lost} more without a result" if self.lost else ""
        return repeats_sentence(self.fails, self.repeats) + lost


def repeats_sentence(fails: int, repeats: int) -> str:
    """Return how many repeats fail, in words, with P(fail) and its interval."""
    low, high = confidence_sequence(fails, repeats)
    mean = (fails + 1.0) / (repeats + 2.0)
    return f"fails in {fails} of {repeats} repeats (P {mean:.2f}, 95 %: {low:.2f} to {high:.2f})"


def repeats_needed(fails: int, repeats: int) -> int | None:
    """Return how many repeats tell at 95 % whether it mostly fails, if this share of them fails.

    None: more than 1,000, since about half of them fail; or there are none yet.
    """
    numbers = range(repeats, 1001 if repeats else 0)
    return next((n for n in numbers if is_decided(round(fails / repeats * n), n)), None)


def is_decided(fails: int, repeats: int) -> bool:
    """Whether it is known at 95 % if it mostly fails: 0.5 is not in `confidence_sequence`."""
    return 20 * (repeats + 1) * math.comb(repeats, fails) <= 1 << repeats


def _kind(one: AtStep) -> str:
    if not one.ok:
        return "no result"
    if one.conflict in ("contact", "near miss") and not one.harmful:
        return f"{one.conflict} that does not count"
    return one.conflict or "no conflict"


class Probes(_Model):
    """Scenarios that were simulated to check a statement.

    Attributes:
        rows: how many.
        harmful: of them.
    """

    rows: Count
    harmful: Count


class Condition(_Model):
    """What a minimal scenario needs of one parameter.

    Where probes did not confirm that it needs it, its value is an example: limit and value agree.

    Attributes:
        name: of the parameter.
        unit: of it.
        sign: ">=" where the parameter lies above its nominal value, "<=" below it.
        limit: the harm persists as far as here when this parameter alone is moved on towards its
            nominal value, and not one step further.
        until: likewise away from its nominal value, or where a constraint ends the move; None where
            the harm persists to the end of its range.
        step: of that parameter.
        value: in the minimal scenario.
        nominal: value of the parameter in the nominal scenario.
        needs: the values as people read them: "≥ 3.4 m/s", "from 3.4 to 7 m/s", "= rain".
        outside: the probes that confirm it: with values outside, the other conditions met; None
            where it is not confirmed, and in records of earlier versions.
    """

    name: Text
    unit: Text
    sign: Literal[">=", "<="]
    limit: Number
    step: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    value: Number
    nominal: Number
    needs: Text = ""
    until: Number | None = None
    outside: Probes | None = None

    @property
    def confirmed(self) -> bool:
        """Whether the scenario needs it: probes outside are harmless."""
        return self.outside is not None


class Minimal(_Model):
    """The scenario of a mode that differs least from the nominal one.

    Attributes:
        name: of its files in ``critical``, "minimal-01"; "" where none are written.
        x: the row of X, all parameters and derived quantities in the run's order.
        noise_key: of its random numbers: those of the row that it was made from.
        values: the parameters that its scenario depends on, by name.
        conditions: the parameters that must differ from nominal, those furthest from it first.
        sentence: they in words.
        inside: feasible random probes that meet all confirmed conditions; examples as in the
            scenario, all else at its default or as near to it as constraints allow.
        rows: neighbours that have a result.
        harmful: of them.
        robustness: harmful / rows.
        harm: of the scenario.
        severity: probability of MAIS3+.
    """

    name: Text
    x: Annotated[tuple[Number, ...], Field(max_length=10_000)]
    noise_key: Annotated[str, Field(pattern=r"^[0-9]{1,20}$")]
    values: Annotated[dict[Text, Number], Field(max_length=10_000)]
    conditions: Annotated[tuple[Condition, ...], Field(max_length=1000)]
    sentence: Annotated[str, Field(max_length=100_000)]
    rows: Count
    harmful: Count
    robustness: Share | None
    harm: Share
    severity: Share
    inside: Probes = Probes(rows=0, harmful=0)

    @property
    def knife_edge(self) -> bool:
        """Whether fewer than half of its neighbours are harmful."""
        return self.robustness is not None and self.robustness < 0.5


class Mode(_Model):
    """A way in which the driver fails.

    Attributes:
        number: 1, 2, … in the order of the record: robust ones first, then by worst harm.
        title: in words.
        conflict: "contact", "near miss" or "violation".
        conflict_type: label of `ConflictType`.
        responsible: label of `Responsible`.
        rule: label of the `Rule` that decides on it most often.
        rules: all that occur with their numbers, the most frequent first; empty in records of
            earlier versions.
        judgement: of ``shown``, see `Neighbourhood`; by the quick cause where it was not tested.
        cause: tested by the neighbours of ``shown``; else the quick one of the rows.
        tested: whether the neighbours gave the cause.
        partner: kind of the other participant: "car", "pedestrian", …; "" if there is none.
        place: "before the junction", "in the junction", "between junctions", "after the
            junction"; "" where the ego's route crosses none, or it is not known.
        count: harmful evaluations of the run.
        space: share of the search space.
        harm: the worst.
        severity: the worst, probability of MAIS3+.
        worst: the evaluation of the worst harm.
        shown: the evaluation that stands for it: the worst robust one of those that were tested.
        robustness: of ``shown``; None where it was not tested.
        examples: evaluations, the worst first; not all of them.
        exports: names of the exported scenarios, the one that stands for it first.
        minimal: its minimal scenario, if one was sought and found.
        probability: how likely it is; None where the run does not estimate it.
    """

    number: Annotated[int, Field(ge=1, le=10**6)]
    title: Text
    conflict: Text
    conflict_type: Text
    responsible: Text
    rule: Text
    cause: CauseLabel
    tested: bool
    partner: Text
    place: Text
    count: Annotated[int, Field(ge=1, le=10**8)]
    space: Estimate
    harm: Share
    severity: Share
    worst: Count
    shown: Count
    robustness: Share | None
    examples: Annotated[tuple[Count, ...], Field(max_length=MOST_EXAMPLES)]
    exports: Annotated[tuple[Text, ...], Field(max_length=1000)] = ()
    minimal: Minimal | None = None
    rules: Annotated[tuple[tuple[Text, Count], ...], Field(max_length=100)] = ()
    judgement: Text = ""
    probability: Frequency | None = None

    @property
    def knife_edge(self) -> bool:
        """Whether fewer than half of the neighbours of ``shown`` are harmful."""
        return self.robustness is not None and self.robustness < 0.5


class Influence(_Model):
    """How differently a parameter is distributed in the failures of a run and in its other rows.

    Attributes:
        name: of the parameter.
        distance: the Kolmogorov-Smirnov distance of the two.
        p: the probability of such a distance by chance, with Bonferroni's correction.
        failures: harmful rows that are compared.
        at_low: of them, those in the lowest 2.5 % of the parameter's range.
        at_high: likewise in the highest.
    """

    name: Text
    distance: Share
    p: Share
    failures: Count
    at_low: Count
    at_high: Count


class Least(_Model):
    """The row with the least margin to harm in one quantity.

    Attributes:
        quantity: "harm", "course_ttc" or "course_braking".
        value: its most critical value; None where no row has one (no collision course).
        unit: of it.
        evaluation: where; None where no row has one.
    """

    quantity: Text
    value: Number | None
    unit: Text
    evaluation: Count | None


class Bound(_Model):
    """The bounds of a run for the whole space, with or without failures.

    Attributes:
        evaluations: of the run.
        failed: of them, simulations without a result.
        implausible: of them, traffic that could not happen.
        harmful: of them.
        space: the harmful share of the search space.
        least: the smallest margins reached.
        verdict: "fails"; "no failure found"; or "not judged", where too few evaluations could be
            judged, or the scenario did not happen. "" in records of earlier versions.
        not_counted: the collisions, near misses and evaluations that do not count as failures,
            with their reasons; "" where there are none.
        sentence: in words.
        in_repeats: evaluations that passed at first and fail in a repeat.
    """

    evaluations: Count
    failed: Count
    implausible: Count
    harmful: Count
    space: Estimate
    least: Annotated[tuple[Least, ...], Field(max_length=20)]
    verdict: Verdict | Literal[""] = ""
    not_counted: Text = ""
    sentence: Text
    in_repeats: Count = 0

    @property
    def in_full(self) -> str:
        """The sentence, and what does not count."""
        return f"{self.sentence} N{self.not_counted[1:]}." if self.not_counted else self.sentence

    @property
    def failures(self) -> int:
        """Harmful evaluations; without any, those of the fresh random draws, or of repeats."""
        drawn = self.space.harmful if self.space.drawn == "fresh" else 0
        return self.harmful or drawn or self.in_repeats

    @property
    def judged(self) -> bool:
        """Whether the run supports a statement on its driver."""
        # Records of earlier versions have no verdict.
        known = self.evaluations - self.failed - self.implausible
        return self.verdict != NOT_JUDGED if self.verdict else known > 0


class Triage(_Model):
    """The triage of a run.

    Attributes:
        schema_version: 1.
        scenario: its name.
        ego: label of its driver.
        baseline: label of the driver that the ego's is compared with: what that one fails in, too,
            is not harmful; "" without one.
        count: whose conflicts count as harm, "ego" or "any".
        results: digest of the evaluations that it was made from, `Rows.digest`.
        seed: of the run, from which all random numbers follow.
        neighbours: of each row that was tested; 0 where none were (see ``untested``).
        radius: by which each searched parameter moves at most, a share of its range.
        sampled: rows that were drawn from those not exported.
        bound: of the space.
        modes: the failure modes, at most ``MOST_MODES``.
        unrecorded_modes: further modes.
        neighbourhoods: of the exported rows, in their order, then of the others.
        untested: why no neighbours were tested; "" where they were.
        influences: the parameters that matter for failure significantly, the most important first.
        fresh: the fresh random rows; None where none were drawn, and in records of earlier
            versions.
        step_checks: findings at fractions of the time step, then some evaluations without failure,
            evenly spread over the run; empty where none were made.
        beyond: exported evaluations outside the region that a dossier calls validated.
        extrapolated: likewise, as a warning; "" where none is, or no dossier was found.
        rate: how likely harm is; None where the run does not estimate it.
        repeated: evaluations that were made again (``--repeats``): exported ones, those that stand
            for modes, further worst ones of each, and some that came near to failing.
    """

    schema_version: Literal[1] = 1
    scenario: Text
    ego: Text
    baseline: Text = ""
    count: Literal["ego", "any"]
    results: Text
    seed: Annotated[int, Field(ge=0)]
    neighbours: Count
    radius: Share
    sampled: Count
    bound: Bound
    modes: Annotated[tuple[Mode, ...], Field(max_length=MOST_MODES)]
    unrecorded_modes: Count = 0
    neighbourhoods: Annotated[tuple[Neighbourhood, ...], Field(max_length=MOST_NEIGHBOURHOODS)]
    untested: Text = ""
    influences: Annotated[tuple[Influence, ...], Field(max_length=1000)] = ()
    fresh: FreshRows | None = None
    step_checks: Annotated[tuple[StepCheck, ...], Field(max_length=MOST_NEIGHBOURHOODS)] = ()
    beyond: Annotated[tuple[Count, ...], Field(max_length=10_000)] = ()
    extrapolated: Text = ""
    rate: Rate | None = None
    repeated: Annotated[tuple[Repeated, ...], Field(max_length=MOST_NEIGHBOURHOODS)] = ()

    @model_validator(mode="after")
    def _consistent(self) -> "Triage":
        if self.fresh is not None:
            known = [value for value in self.fresh.harm if value is not None]
            harmful = sum(value >= NEAR_MISS for value in known)
            if (self.bound.space.rows, self.bound.space.harmful) != (len(known), harmful):
                raise ValueError("the fresh rows must be those that the share is estimated from")
            if len(self.fresh.mode) != len(self.fresh.harm):
                raise ValueError("each fresh row must have its mode")
        if [mode.number for mode in self.modes] != list(range(1, len(self.modes) + 1)):
            raise ValueError("modes must be numbered 1, 2, …")
        if sum(mode.count for mode in self.modes) > self.bound.harmful:
            raise ValueError("modes must not hold more rows than are harmful")
        named = [i for mode in self.modes for i in (mode.worst, mode.shown, *mode.examples)]
        named += [neighbourhood.evaluation for neighbourhood in self.neighbourhoods]
        named += [check.evaluation for check in self.step_checks]
        named += [item.evaluation for item in self.repeated]
        # A record may be damaged or another's: readers index the store's rows by these numbers.
        if max(named, default=-1) >= self.bound.evaluations:
            raise ValueError(f"evaluation {max(named)} must be one of the run's")
        return self

    def neighbourhood(self, evaluation: int) -> Neighbourhood | None:
        """Return the results of an evaluation's neighbours, if they were tested."""
        found = (item for item in self.neighbourhoods if item.evaluation == evaluation)
        return next(found, None)

    def step_check(self, evaluation: int) -> StepCheck | None:
        """Return the results of an evaluation at fractions of the time step, if it was checked."""
        return next((item for item in self.step_checks if item.evaluation == evaluation), None)

    def of_repeats(self, evaluation: int) -> Repeated | None:
        """Return the results of an evaluation's repeats, if it was made again."""
        return next((item for item in self.repeated if item.evaluation == evaluation), None)

    def chance(self, mode: Mode) -> tuple[float, float, float] | None:
        """Return P(fail | scenario) of a mode's repeated rows: the mean, and its 95 % interval."""
        some = [item for item in self.repeated if item.mode == mode.number and item.repeats]
        fails, repeats = [item.fails for item in some], [item.repeats for item in some]
        return beta_binomial(fails, repeats) if some else None

    def doubts(self, evaluation: int) -> str:
        """Return what makes the verdict on an evaluation doubtful; "" if nothing is known to."""
        check, beyond = self.step_check(evaluation), evaluation in self.beyond
        again = self.of_repeats(evaluation)
        return ", ".join(
            ([] if again is None or again.agrees else [again.sentence])
            + ["depends on the time step"] * (check is not None and not check.stable)
            + ["outside the validated region"] * beyond
        )

    @property
    def missed(self) -> int:
        """How many of the evaluations without failure that were checked fail at a finer step."""
        return sum(
            not check.at[0].harmful and any(one.harmful for one in check.at)
            for check in self.step_checks
        )

    @property
    def robust(self) -> int:
        """How many modes are not knife-edge; those that were not tested count."""
        return sum(not mode.knife_edge for mode in self.modes)


def write_record(folder: Path, triage: Triage) -> Path:
    """Write the record into a run's folder atomically; return its path.

    Raises:
        StorageError: it cannot be written.
    """
    path = folder / JSON_FILE
    # Without rates and repeats the record is as it was before there were any.
    unused: dict[str, Any] = {}
    if not triage.rate:
        unused |= {"rate": True, "modes": {"__all__": {"probability"}}}
    if not triage.repeated:
        unused |= {"repeated": True, "bound": {"in_repeats"}}
    write_whole(path, [triage.model_dump_json(indent=1, exclude=unused or None).encode(), b"\n"])
    return path


def read_record(path: Path, results: str | None = None) -> Triage | None:
    """Return a record of `write_record`; None if the file does not exist.

    Args:
        path: of the record.
        results: digest of the run's evaluations, `Rows.digest`, if it is known.

    Raises:
        FileFormatError: it is not such a record, or belongs to another run.
        StorageError: it cannot be read.
    """
    record = read_model(path, Triage, _not_ours)
    # Rows may have been added since (resume): what is said of others would be wrong of these.
    if record is not None and results is not None and record.results != results:
        raise _not_ours(path, "it was made from other evaluations than the run's")
    return record


def _not_ours(path: Path, why: str) -> FileFormatError:
    return FileFormatError(
        f"{path}: must be the triage of this run, as 'bridgegen resume {path.parent}' writes it: "
        f"{why}"
    )
