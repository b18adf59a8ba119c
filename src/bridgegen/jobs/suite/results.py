"""The results of a suite: of each entry and ego a line of JSON, of each row what happened."""

from collections import Counter
from collections.abc import Sequence
from math import isfinite
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from bridgegen.assess.conflict.findings import why_unjudged
from bridgegen.search.triage.bound import too_few
from bridgegen.search.triage.record import repeats_needed, repeats_sentence

Verdict = Literal["passed", "failed", "not judged", "not run", "flaky"]
VERDICTS: tuple[Verdict, ...] = ("passed", "failed", "not judged", "not run", "flaky")

Outcome = Literal["avoided", "mitigated", "not avoided"]
OUTCOMES: tuple[Outcome, ...] = ("avoided", "mitigated", "not avoided")

STANDS = 0.1 / 3.6
"""Speed up to which the ego counts as standing [m/s]. Euro NCAP measures speeds to 0.1 km/h (Crash
Avoidance protocol, Frontal Collisions, 1.1, section 1.5.2)."""

REDUCED = 1.0 / 3.6
"""Speed reduction that the ego's speed at its impact must exceed [m/s]. It is the tolerance of the
test speed in that protocol (section 4.3.2)."""

PASSED, FAILED, EXCUSED, NOT_RUN, NOT_APPLICABLE = "pfunx"
"""Results of a variation for a clause: it passes; fails; passes although the ego collides, since
the models do, too; has no result; or says nothing, e.g. as its traffic could not happen."""


class Strict(BaseModel):
    """Part of a record; it is untrusted when it is read."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class RowResult(Strict):
    """The result of one variation; of several evaluations of it, the first of the worst.

    Attributes:
        x: values of the entry's ``parameters``; texts by themselves.
        problem: why there is no result; empty where there is one.
        critical: by the rule of the suite.
        harm: how much it is a failure of the ego, 0 to 1.
        severity: probability of MAIS3+ in the ego's collision.
        collisions: number of the ego's contacts.
        d_min: smallest distance to others [m]; None: there are none.
        impact_speed: the ego's at its first contact [m/s]; 0: none, or it stands.
        relative_impact_speed: the same, less the other's speed along the ego's heading [m/s].
        speed_reduction: the ego's speed at the start less that at its first contact [m/s]; 0
            without one.
        conflict: of the decisive conflict: "contact", "near miss", … , or "".
        conflict_type: its type.
        responsible: who is, for a contact or near miss.
        partner: the other participant.
        implausible: why its traffic could not happen, or "".
        unsafe_start: whether the ego's contact or near miss does not count because it had no time
            to act from the start on.
        margins: of the entry's criteria; None: without a result.
        clauses: what it means for each of the entry's clauses, a letter each; empty without a
            result.
        repeats: how many evaluations of it pass or fail; 1 where it was evaluated once.
        fails: of them, where there are several.
    """

    x: list[float | str] = []
    problem: str = ""
    critical: bool = False
    harm: float = 0.0
    severity: float = 0.0
    collisions: float = 0.0
    d_min: float | None = None
    impact_speed: float = 0.0
    relative_impact_speed: float = 0.0
    speed_reduction: float = 0.0
    conflict: str = ""
    conflict_type: str = ""
    responsible: str = ""
    partner: str = ""
    implausible: str = ""
    unsafe_start: bool = False
    margins: list[float] = []
    clauses: str = Field(default="", pattern="^[pfunx]{0,1000}$")
    repeats: int = 1
    fails: int = 0

    @classmethod
    def of_repeats(cls, tries: "Sequence[RowResult]") -> "RowResult":
        """Return the result of evaluations of one variation, in their order."""
        if len(tries) == 1:
            return tries[0]
        verdicts = [row.verdict for row in tries]
        worst = next(name for name in (*WORST, "passed") if name in verdicts)
        row, fails = tries[verdicts.index(worst)], verdicts.count("failed")
        counts: dict[str, Any] = {"repeats": fails + verdicts.count("passed"), "fails": fails}
        if row.problem:
            counts["problem"] = f"{verdicts.count(worst)} of {len(tries)} repeats: {row.problem}"
        return row.model_copy(update=counts)

    @property
    def flaky(self) -> str:
        """That its evaluations disagree, in words, and how many tell more; "" if they agree."""
        if not 0 < self.fails < self.repeats:
            return ""
        needed = repeats_needed(self.fails, self.repeats)
        number = "more than 1000" if needed is None else needed
        sentence = repeats_sentence(self.fails, self.repeats)
        return f"flaky: {sentence}; needs {number} repeats for a verdict at 95 %"

    @property
    def verdict(self) -> Verdict:
        """Whether the ego passes: it neither is critical nor violates a criterion or a clause."""
        if self.problem:
            return "not run"
        if 0 < self.fails < self.repeats:
            return "flaky"
        if self.critical or self.violated or FAILED in self.clauses:
            return "failed"
        return "not judged" if self.unjudged else "passed"

    @property
    def unjudged(self) -> str:
        """Why a variation that does not fail says nothing of the ego; "" if it does.

        A clause judges where there is no time to act, too: by whether the models collide.
        """
        by_clause = PASSED in self.clauses or EXCUSED in self.clauses
        return why_unjudged(self.implausible, self.unsafe_start and not by_clause)

    @property
    def outcome(self) -> Outcome | None:
        """Whether the ego avoids the collision, or reduces its speed; None without a result.

        A contact while the ego stands, of one who walks or drives into it, counts as avoided.
        """
        if self.problem:
            return None
        if self.collisions == 0.0 or self.impact_speed <= STANDS:
            return "avoided"
        return "mitigated" if self.speed_reduction > REDUCED else "not avoided"

    @property
    def violated(self) -> list[int]:
        """The numbers of the criteria that it violates."""
        return [i for i, margin in enumerate(self.margins) if margin < 0.0]


WORST: tuple[Verdict, ...] = ("failed", "flaky", "not run", "not judged")
"""Verdicts that are no pass, the worst first: a failure is one whatever else did not run."""


class GridResult(Strict):
    """A grid of a matrix that an entry runs; see `bridgegen.scenario.language.protocols.Grid`.

    Attributes:
        label: the text of the column ``matrix`` in its rows.
        edition: of the protocol.
        score: how its rows are rated, or "".
        points: that they are worth together.
        graded: whether colours count in part; if not, any but red counts fully.
    """

    label: str
    edition: str
    score: str = ""
    points: float = 0.0
    graded: bool = True


class EntryResult(Strict):
    """The results of an entry with an ego.

    Attributes:
        entry: its name.
        ego: as the user names it; the scenario's own driver if none.
        digest: of the entry's files.
        driver_digest: of the file of a driver of the user's.
        scenario: path or name.
        distribution: path, or "".
        driver: that drove the ego, by name.
        title: of the scenario.
        parameters: the names of what varies.
        units: theirs.
        criteria: as `bridgegen.scenario.language.criteria.Criterion.to_dict` gives them.
        grids: of the matrix that it runs, if it has one.
        sampled: whether its rows are some of very many, drawn evenly or at random.
        clauses: as `bridgegen.scenario.language.protocols.Clause.to_dict` gives them.
        rows: of each variation; empty if the entry cannot run.
        problem: why it cannot; empty if it can.
        notes: what runs otherwise than one may expect.
        not_happened: why what the scenario is about does not happen in its rows, a clause each; see
            `bridgegen.assess.conflict.happening.Happening.reasons`. Empty if it does.
        outside: a sentence if the ego's driver is not made for the scenario; see
            `bridgegen.engine.domain.outside`.
    """

    entry: str
    ego: str
    digest: str
    driver_digest: str = ""
    scenario: str
    distribution: str = ""
    driver: str = ""
    title: str = ""
    parameters: list[str] = []
    units: list[str] = []
    criteria: list[dict[str, Any]] = []
    grids: list[GridResult] = []
    sampled: bool = False
    clauses: list[dict[str, Any]] = []
    rows: list[RowResult] = []
    problem: str = ""
    notes: list[str] = []
    not_happened: list[str] = []
    outside: str = ""

    @property
    def verdict(self) -> Verdict:
        """The worst of its rows: failed, else flaky or not run; else whether it is judged."""
        verdicts = {row.verdict for row in self.rows}
        # A failure is one whatever else did not run: it is never hidden by a missing result.
        for name in WORST[:2]:
            if name in verdicts:
                return name
        if self.problem or not self.rows or "not run" in verdicts:
            return "not run"
        return "not judged" if self.unjudged else "passed"

    @property
    def verdicts(self) -> list[Verdict]:
        """The verdict of each row; none passes where nothing says anything of the ego."""
        found = [row.verdict for row in self.rows]
        return ["not judged" if name == "passed" and self._says_nothing else name for name in found]

    @property
    def _says_nothing(self) -> bool:
        return bool(self.not_happened or self.outside)

    @property
    def unjudged(self) -> str:
        """Why rows without a failure say nothing of the ego, as those of a run; "" if they do."""
        if not self.rows:
            return ""
        reasons = Counter(row.unjudged for row in self.rows if row.verdict == "not judged")
        judged, n = len(self.rows) - reasons.total(), len(self.rows)
        if few := too_few(judged, n, "variations could be judged"):
            why = ", ".join(f"{rows} × {why}" for why, rows in reasons.most_common())
            return f"{few}: {why}" if n > 1 else next(iter(reasons))
        happened = "; ".join(self.not_happened)
        return f"the scenario did not happen: {happened}" if happened else self.outside

    def count(self, verdict: Verdict) -> int:
        """Return the number of rows with a verdict; an entry that cannot run counts as one."""
        if self.problem:
            return int(verdict == "not run")
        return self.verdicts.count(verdict)

    def outcomes(self) -> dict[Outcome, int]:
        """Return the numbers of rows by outcome."""
        found = [row.outcome for row in self.rows]
        return {outcome: found.count(outcome) for outcome in OUTCOMES}

    @property
    def worst(self) -> int | None:
        """The number of the worst failed row: by harm, then by the least margin."""
        failed = [i for i, row in enumerate(self.rows) if row.verdict == "failed"]
        return min(failed, key=lambda i: (*rank(self.rows[i]), i), default=None)

    def letters(self, clause: int) -> str:
        """Return what each variation means for a clause, by its number.

        An entry that cannot run counts as one. None passes where what the scenario is about did not
        happen, or the ego's driver is not made for it.
        """
        if not self.rows:
            return NOT_RUN
        # A row without a result has no letters; a flaky one passes nothing.
        found = "".join(
            NOT_RUN if row.flaky and letter != FAILED else letter
            for row in self.rows
            for letter in (row.clauses[clause : clause + 1] or NOT_RUN,)
        )
        if not self._says_nothing:
            return found
        # Failures stay: only what would pass says nothing.
        return found.replace(PASSED, NOT_APPLICABLE).replace(EXCUSED, NOT_APPLICABLE)


class Header(Strict):
    """What all lines of a file of results have in common.

    Attributes:
        suite: the format's version.
        settings: on which results depend.
    """

    suite: Literal[1] = Field(default=1)
    settings: dict[str, Any]


def rank(row_result: RowResult) -> tuple[float, float, float]:
    """Return a key that is less for a worse failure: by harm, severity, then the least margin."""
    return (
        -float(row_result.critical) * row_result.harm,
        -row_result.severity,
        min(row_result.margins, default=0.0),
    )


def finite(value: float) -> float | None:
    """Return a number for JSON; None if it is infinite or NaN."""
    return value if isfinite(value) else None


def counts(results: Sequence[EntryResult]) -> dict[Verdict, int]:
    """Return the numbers of rows by verdict."""
    return {verdict: sum(each.count(verdict) for each in results) for verdict in VERDICTS}
