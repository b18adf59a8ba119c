"""What the terminal and ``--json`` show of a suite, and of the difference of two drivers."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from bridgegen.assess.conflict.findings import with_whom
from bridgegen.base.units import percent
from bridgegen.jobs.frame import Table
from bridgegen.jobs.suite.clauses import clause_results
from bridgegen.jobs.suite.difference import DriverDifference
from bridgegen.jobs.suite.known_failures import words as known_words
from bridgegen.jobs.suite.results import EntryResult, counts
from bridgegen.jobs.suite.sentences import clause_in_words, outcomes, points, points_of
from bridgegen.jobs.suite.suite import SEALED, SuiteRun

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
            ego: {
                point.edition: [point.reached, point.most] for point in points_of(suite.of_ego(ego))
            }
            for ego in suite.egos
        },
        "clauses": [
            {"verdict": result.verdict, **asdict(result)}
            for ego in suite.egos
            for result in clause_results(suite.results, ego)
        ],
        "unanswered": [
            dict(zip(("id", "text", "reason"), clause, strict=True)) for clause in suite.unanswered
        ],
        "entries": [
            {
                "entry": result.entry,
                "ego": result.ego or result.driver,
                "verdict": result.verdict,
                "variations": len(result.rows),
                "failed": result.count("failed"),
                "not_judged": result.count("not judged"),
                "not_run": result.count("not run"),
                "flaky": [text for row in result.rows if (text := row.flaky)],
                "unjudged": result.unjudged if result.verdict == "not judged" else None,
                "outcomes": result.outcomes(),
                "problem": result.problem or None,
                "status": suite.known_failures.status_of(result.entry),
                "standing": suite.known_failures.worst(result),
            }
            for result in suite.results
        ],
        "maps": [
            {
                "scenario": map_.scenario.name,
                "drivers": [map_.figures(name) for name in map_.drivers],
            }
            for map_ in suite.maps
        ],
        **({"sealed": suite.sealed.model_dump(exclude={"results"})} if suite.sealed else {}),
    }


def suite_shown(suite: SuiteRun) -> list[str | Table]:
    """Return the entries that do not pass, others if there is room; then clauses and totals."""
    by_entry: dict[str, list[EntryResult]] = {}
    for result in suite.results:
        by_entry.setdefault(result.entry, []).append(result)
    passed = [name for name, some in by_entry.items() if {o.verdict for o in some} == {"passed"}]
    failed = [name for name in by_entry if name not in passed]
    left = max(0, MOST_ROWS - len(failed))
    listed = {*failed[:MOST_ROWS], *passed[:left]}
    egos = list(suite.labels)
    rows = [
        (name, *(_verdict(suite, result) for result in some), _worst(some))
        for name, some in by_entry.items()
        if name in listed
    ]
    found: list[str | Table] = [Table(("scenario", *egos, "worst"), rows)]
    if len(by_entry) > len(listed):
        found.append(f"and {len(by_entry) - len(listed)} more")
    by_ego = [clause_results(suite.results, ego) for ego in suite.egos]
    if any(by_ego) or suite.unanswered:
        clauses = [
            (pair[0].id, *map(clause_in_words, pair), pair[0].text)
            for pair in zip(*by_ego, strict=True)
        ]
        none = ["not answered"] * len(egos)
        clauses += [(id, *none, f"{text}: {why}") for id, text, why in suite.unanswered]
        found += ["", Table(("clause", *egos, "requirement"), clauses)]
    by_label = zip(suite.egos, suite.labels, strict=True)
    found += ["", *(line for ego, label in by_label for line in _totals(suite, ego, label))]
    if gone := suite.known_failures.gone(suite.results):
        found.append(f"no longer fail, set their status to fixed: {', '.join(gone)}")
    found += [f"map         {map_.page}" for map_ in suite.maps]
    if suite.sealed is not None:
        found += [f"sealed      {suite.folder / SEALED}", f"seal        {suite.sealed.seal}"]
    return [*found, f"page        {suite.page}"]


def _totals(suite: SuiteRun, ego: str, label: str) -> Iterator[str]:
    """Yield what an ego makes of the suite, and how its failures stand where indexes name some."""
    results = suite.of_ego(ego)
    number = counts(results)
    entries = sum(result.verdict == "passed" for result in results)
    unjudged = sum(result.verdict == "not judged" for result in results)
    yield (
        f"{label}: {entries} of {len(results)} scenarios pass"
        + (f", {unjudged} {'is' if unjudged == 1 else 'are'} not judged" if unjudged else "")
        + f"; of their variations {number['passed']} pass, {number['failed']} fail, "
        + (f"{number['flaky']} are flaky, " if number["flaky"] else "")
        + (f"{number['not judged']} not judged, " if number["not judged"] else "")
        + f"{number['not run']} did not run"
    )
    sentence = suite.known_failures.sentence(results)
    said = (outcomes(results), points(results), sentence, *suite.drawn_lines(ego))
    for text in filter(None, said):
        yield f"  {text}"
    for id in suite.known_failures.regressions(results):
        yield f"  regression: {id} was fixed, and fails again"


def _verdict(suite: SuiteRun, entry_result: EntryResult) -> str:
    said = known_words(
        suite.known_failures.worst(entry_result),
        suite.known_failures.failures.get(entry_result.entry),
    )
    return f"{_counted(entry_result)} ({said})" if said else _counted(entry_result)


def _counted(entry_result: EntryResult) -> str:
    if entry_result.problem:
        return "not run"
    n = len(entry_result.rows)
    failed, unjudged, lost = (entry_result.count(v) for v in ("failed", "not judged", "not run"))
    flaky = entry_result.count("flaky")
    if not failed and not unjudged and not lost and not flaky:
        return "pass" if n == 1 else f"pass ({n})"
    parts = [f"{failed} of {n} fail"] if failed else []
    parts += [f"{flaky} of {n} flaky"] if flaky else []
    if entry_result.verdict == "not judged":
        parts.append("NOT JUDGED")
    elif unjudged:
        parts += [] if failed or lost else [f"pass ({n - unjudged})"]
        parts.append(f"{unjudged} not judged")
    parts += [f"{lost} not run"] if lost else []
    _, slowed, unslowed = entry_result.outcomes().values()
    if slowed + unslowed:
        parts.append(f"{slowed + unslowed} collide, {slowed} after slowing down")
    return ", ".join(parts)


def _worst(some: Sequence[EntryResult]) -> str:
    """Return the worst thing that happens in an entry."""
    for result in some:
        if result.worst is not None:
            row = result.rows[result.worst]
            violated = ", ".join(str(result.criteria[i]["id"]) for i in row.violated)
            happened = row.critical and row.conflict
            texts = [with_whom(row.conflict, row.partner)] if happened else []
            texts += [f"impact at {row.impact_speed:.1f} m/s"] if row.impact_speed else []
            texts += [f"MAIS3+ {percent(row.severity)}"] if row.severity else []
            texts += [f"violates {violated}"] if violated else []
            return "; ".join(texts)
    lost = [text for result in some for row in result.rows if (text := row.flaky)][:1] + [
        result.problem or next((r.problem for r in result.rows if r.problem), "") for result in some
    ]
    return next(filter(None, [*lost, *(o.unjudged for o in some if o.verdict == "not judged")]), "")


def json_of_difference(found: DriverDifference) -> dict[str, Any]:
    """Return what is broken or fixed, and what searches found, as JSON's types."""
    made = found.difference
    return {
        "first": made.first,
        "second": made.second,
        "headline": made.headline,
        "kinds": made.kinds,
        "counts": made.counts,
        "p_value": made.p_value,
        "unjudged": made.unjudged,
        "rows": [vars(row) for row in made.rows if row.change in ("broken", "fixed")],
        "searches": [{**vars(search), "folder": str(search.folder)} for search in found.searches],
    }


def difference_shown(found: DriverDifference) -> list[str | Table]:
    """Return what is broken and fixed from the first ego to the second, then the searches."""
    made = found.difference
    number = made.counts
    by_entry: dict[str, dict[str, int]] = {}
    for row in made.rows:
        of_it = by_entry.setdefault(row.entry, dict.fromkeys(number, 0))
        of_it[row.change] += 1
    changed = [
        (name, *map(str, of_it.values()))
        for name, of_it in by_entry.items()
        if of_it["broken"] or of_it["fixed"] or of_it["not comparable"]
    ]
    lines: list[str | Table] = [made.headline, ""]
    if changed:
        lines += [Table(("scenario", *number), changed[:MOST_ROWS]), ""]
    for change in ("broken", "fixed"):
        low, high = made.interval(change)
        sure = f" ({percent(low)} to {percent(high)} with 95 % confidence)" if made.sampled else ""
        lines.append(f"  {change:<16}{number[change]}{sure}")
    lines.append(f"  {'both fail':<16}{number['both fail']}")
    lines.append(f"  {'both pass':<16}{number['both pass']}")
    if number["not comparable"]:
        lines.append(f"  {'not comparable':<16}{number['not comparable']}")
    compared = [row.severity for row in made.rows if row.change != "not comparable"]
    worse, better = (sum(sign * value > 0.0 for value in compared) for sign in (1.0, -1.0))
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
    for search in found.searches:
        if search.problem:
            yield f"  {search.entry}: no result: {search.problem}"
        elif search.worse:
            yield f"  {search.entry}: {search.sentence}"
            yield from (f"    {title}" for title in search.modes[:MOST_MODES])
            yield f"    {search.folder / 'report.html'}"
    if none := [search for search in found.searches if not search.worse and not search.problem]:
        evaluations = sum(than.evaluations for than in none)
        others = "other" if len(none) == 1 else "others"
        yield f"  none in {len(none)} {others} ({evaluations} evaluations)"
    yield ""
