"""What the terminal and ``--json`` show of a suite, and of the difference of two drivers."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from bridgegen.assess.conflict.findings import with_whom
from bridgegen.jobs.frame import Table
from bridgegen.jobs.suite.clauses import clause_results
from bridgegen.jobs.suite.difference import DriverDifference
from bridgegen.jobs.suite.known_failures import words as known_words
from bridgegen.jobs.suite.results import EntryResult, counts
from bridgegen.jobs.suite.sentences import clause_in_words, outcomes, points, points_of
from bridgegen.jobs.suite.suite import SuiteRun

MOST_MODES = 3
"""Largest number of failure modes of a search that are named."""

MOST_ROWS = 40
"""Largest number of entries of the table; those that pass are left out first."""


def json_of_suite(suite: SuiteRun) -> dict[str, Any]:
    """Return the verdicts, counts, points, clauses and maps of a suite as JSON's types."""
    return {
        "folder": str(suite.folder),
        "egos": list(suite.egos),
        "counts": {ego: counts(suite.of_ego(ego)) for ego in suite.egos},
        "points": {
            ego: {one.edition: [one.reached, one.most] for one in points_of(suite.of_ego(ego))}
            for ego in suite.egos
        },
        "clauses": [
            {"verdict": one.verdict, **asdict(one)}
            for ego in suite.egos
            for one in clause_results(suite.results, ego)
        ],
        "entries": [
            {
                "entry": one.entry,
                "ego": one.ego or one.driver,
                "verdict": one.verdict,
                "variations": len(one.rows),
                "failed": one.count("failed"),
                "not_judged": one.count("not judged"),
                "not_run": one.count("not run"),
                "unjudged": one.unjudged if one.verdict == "not judged" else None,
                "outcomes": one.outcomes(),
                "problem": one.problem or None,
                "status": suite.known_failures.status_of(one.entry),
                "standing": suite.known_failures.worst(one),
            }
            for one in suite.results
        ],
        "maps": [
            {"scenario": one.scenario.name, "drivers": [one.figures(name) for name in one.drivers]}
            for one in suite.maps
        ],
    }


def suite_shown(suite: SuiteRun) -> list[str | Table]:
    """Return the entries that do not pass, others if there is room; then clauses and totals."""
    by_entry: dict[str, list[EntryResult]] = {}
    for one in suite.results:
        by_entry.setdefault(one.entry, []).append(one)
    passed = [name for name, some in by_entry.items() if {o.verdict for o in some} == {"passed"}]
    failed = [name for name in by_entry if name not in passed]
    left = max(0, MOST_ROWS - len(failed))
    listed = {*failed[:MOST_ROWS], *passed[:left]}
    egos = [ego or "ego's own driver" for ego in suite.egos]
    rows = [
        (name, *(_verdict(suite, one) for one in some), _worst(some))
        for name, some in by_entry.items()
        if name in listed
    ]
    found: list[str | Table] = [Table(("scenario", *egos, "worst"), rows)]
    if len(by_entry) > len(listed):
        found.append(f"and {len(by_entry) - len(listed)} more")
    by_ego = [clause_results(suite.results, ego) for ego in suite.egos]
    if any(by_ego):
        clauses = [
            (one[0].id, *map(clause_in_words, one), one[0].text)
            for one in zip(*by_ego, strict=True)
        ]
        found += ["", Table(("clause", *egos, "requirement"), clauses)]
    found += ["", *(line for ego in suite.egos for line in _totals(suite, ego))]
    if gone := suite.known_failures.gone(suite.results):
        found.append(f"no longer fail, set their status to fixed: {', '.join(gone)}")
    found += [f"map         {one.page}" for one in suite.maps]
    return [*found, f"page        {suite.page}"]


def _totals(suite: SuiteRun, ego: str) -> Iterator[str]:
    """Yield what an ego makes of the suite, and how its failures stand where indexes name some."""
    results = suite.of_ego(ego)
    number = counts(results)
    entries = sum(one.verdict == "passed" for one in results)
    unjudged = sum(one.verdict == "not judged" for one in results)
    yield (
        f"{ego or 'the own drivers'}: {entries} of {len(results)} scenarios pass"
        + (f", {unjudged} {'is' if unjudged == 1 else 'are'} not judged" if unjudged else "")
        + f"; of their variations {number['passed']} pass, {number['failed']} fail, "
        + (f"{number['not judged']} not judged, " if number["not judged"] else "")
        + f"{number['not run']} did not run"
    )
    sentence = suite.known_failures.sentence(results)
    for text in filter(None, (outcomes(results), points(results), sentence)):
        yield f"  {text}"
    for id in suite.known_failures.regressions(results):
        yield f"  regression: {id} was fixed, and fails again"


def _verdict(suite: SuiteRun, one: EntryResult) -> str:
    said = known_words(
        suite.known_failures.worst(one), suite.known_failures.failures.get(one.entry)
    )
    return f"{_counted(one)} ({said})" if said else _counted(one)


def _counted(one: EntryResult) -> str:
    if one.problem:
        return "not run"
    n = len(one.rows)
    failed, unjudged, lost = (one.count(v) for v in ("failed", "not judged", "not run"))
    if not failed and not unjudged and not lost:
        return "pass" if n == 1 else f"pass ({n})"
    parts = [f"{failed} of {n} fail"] if failed else []
    if one.verdict == "not judged":
        parts.append("NOT JUDGED")
    elif unjudged:
        parts += [] if failed or lost else [f"pass ({n - unjudged})"]
        parts.append(f"{unjudged} not judged")
    parts += [f"{lost} not run"] if lost else []
    _, slowed, unslowed = one.outcomes().values()
    if slowed + unslowed:
        parts.append(f"{slowed + unslowed} collide, {slowed} after slowing down")
    return ", ".join(parts)


def _worst(some: Sequence[EntryResult]) -> str:
    """Return the worst thing that happens in an entry."""
    for one in some:
        if one.worst is not None:
            row = one.rows[one.worst]
            violated = ", ".join(str(one.criteria[i]["id"]) for i in row.violated)
            happened = row.critical and row.conflict
            texts = [with_whom(row.conflict, row.partner)] if happened else []
            texts += [f"impact at {row.impact_speed:.1f} m/s"] if row.impact_speed else []
            texts += [f"MAIS3+ {row.severity:.2%}"] if row.severity else []
            texts += [f"violates {violated}"] if violated else []
            return "; ".join(texts)
    lost = [one.problem or next((r.problem for r in one.rows if r.problem), "") for one in some]
    return next(filter(None, [*lost, *(o.unjudged for o in some if o.verdict == "not judged")]), "")


def json_of_difference(found: DriverDifference) -> dict[str, Any]:
    """Return what is broken or fixed, and what searches found, as JSON's types."""
    made = found.difference
    return {
        "first": made.first,
        "second": made.second,
        "counts": made.counts,
        "p_value": made.p_value,
        "unjudged": made.unjudged,
        "rows": [vars(one) for one in made.rows if one.change in ("broken", "fixed")],
        "searches": [{**vars(one), "folder": str(one.folder)} for one in found.searches],
    }


def difference_shown(found: DriverDifference) -> list[str | Table]:
    """Return what is broken and fixed from the first ego to the second, then the searches."""
    made = found.difference
    number = made.counts
    by_entry: dict[str, dict[str, int]] = {}
    for one in made.rows:
        of_it = by_entry.setdefault(one.entry, dict.fromkeys(number, 0))
        of_it[one.change] += 1
    changed = [
        (name, *map(str, of_it.values()))
        for name, of_it in by_entry.items()
        if of_it["broken"] or of_it["fixed"] or of_it["not comparable"]
    ]
    lines: list[str | Table] = []
    if changed:
        lines += [Table(("scenario", *number), changed[:MOST_ROWS]), ""]
    n = len(made.rows) - number["not comparable"]
    lines.append(f"{made.second} against {made.first}, {n} variations")
    for change in ("broken", "fixed"):
        low, high = made.interval(change)
        sure = f" ({low:.2%} to {high:.2%} with 95 % confidence)" if made.sampled else ""
        lines.append(f"  {change:<16}{number[change]}{sure}")
    lines.append(f"  {'both fail':<16}{number['both fail']}")
    lines.append(f"  {'both pass':<16}{number['both pass']}")
    if number["not comparable"]:
        lines.append(f"  {'not comparable':<16}{number['not comparable']}")
    compared = [one.severity for one in made.rows if one.change != "not comparable"]
    worse, better = (sum(sign * one > 0.0 for one in compared) for sign in (1.0, -1.0))
    lines.append(f"  {'severity':<16}higher in {worse}, lower in {better}")
    if made.sampled:
        lines.append(f"  {'by chance':<16}p = {made.p_value:.3g} (McNemar's exact test)")
    return [*lines, *_of_searches(found), f"page        {found.page}"]


def _of_searches(found: DriverDifference) -> Iterator[str]:
    """Yield where searches found the second ego worse; then how many found nothing."""
    if not found.searches:
        return
    made = found.difference
    yield f"\nsearches for scenarios that {made.second} fails and {made.first} passes"
    for one in found.searches:
        if one.problem:
            yield f"  {one.entry}: no result: {one.problem}"
        elif one.worse:
            yield f"  {one.entry}: {one.sentence}"
            yield from (f"    {title}" for title in one.modes[:MOST_MODES])
            yield f"    {one.folder / 'report.html'}"
    if none := [one for one in found.searches if not one.worse and not one.problem]:
        evaluations = sum(one.evaluations for one in none)
        others = "other" if len(none) == 1 else "others"
        yield f"  none in {len(none)} {others} ({evaluations} evaluations)"
    yield ""
