"""What the page of a suite holds, as plain data."""

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.physics import HARD_BRAKING
from bridgegen.jobs.suite.clauses import clause_results
from bridgegen.jobs.suite.difference import (
    KINDS,
    Difference,
    WorseThan,
    in_order,
    suite_difference,
)
from bridgegen.jobs.suite.known_failures import EXCUSED, words
from bridgegen.jobs.suite.results import EntryResult, Outcome, RowResult, Verdict, rank
from bridgegen.jobs.suite.sentences import (
    changes,
    clause_in_words,
    colours_of,
    difference,
    differences,
    headline,
    outcomes,
    points,
)
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.pages.packed import OF_ROW, deflated, road_key
from bridgegen.pages.payload import script_json
from bridgegen.pages.playback import Playback
from bridgegen.pages.playback_payload import ROAD_SCALE, SCALE, playback_payload, road_payload
from bridgegen.pages.playbacks import diverged_at

SIZE, SIZE_OF_RESULT = 2_600_000, 600
"""Maximum number of characters of a page with 1,000 results, and how many more it may have for each
further one."""

MOTIONS = 1_200_000
"""Maximum number of characters of all playbacks."""

MOST_MODES = 10
"""Largest number of failure modes of each search that the page names."""

MOST_ROWS = 1000
"""Maximum number of variations that the page holds of an entry with an ego."""

MOST_CHANGES = 3000
"""Maximum number of variations that the page lists of the difference of two egos."""

Key = tuple[str, str]
"""Name of an entry, and the ego as the user names it."""

Played = tuple[str, str, int]
"""The same, and the number of a row."""


@dataclass(frozen=True)
class Motion:
    """What the page plays of a variation.

    Attributes:
        entry: by name.
        egos: whose variation it is: one, or both of two.
        row: its number, from 0 on.
        playback: with the ego; of two, with the second.
        twin: of two, with the first.
    """

    entry: str
    egos: tuple[str, ...]
    row: int
    playback: Playback
    twin: Playback | None = None


_LETTER: dict[Verdict, str] = {"passed": "p", "failed": "f", "not run": "n", "not judged": "u"}
_LETTER["flaky"] = "y"
_OUTCOME: dict[Outcome | None, str] = {
    "avoided": "a",
    "mitigated": "m",
    "not avoided": "n",
    None: "-",
}
_HAPPENED = ("contact", "near miss", "violation")
_SEVERITIES = ("critical", "major", "minor")


def key_of(result: EntryResult) -> Key:
    """Return what identifies a result."""
    return result.entry, result.ego


def payload(
    suite: SuiteRun,
    played: Sequence[Motion],
    commands: Mapping[Key, str],
    *,
    searches: Sequence[WorseThan] = (),
    maps: Sequence[Mapping[str, Any]] = (),
    code: int = 0,
) -> dict[str, Any]:
    """Return the page's data as plain dicts, lists, numbers and strings.

    Variations take what the rest leaves: of each entry the failed ones first, then those that did
    not run, then those that are not judged, then those that pass.

    Args:
        suite: the results.
        played: the worst failed rows; of two egos what changes, too.
        commands: that show failures again.
        searches: for where the second of two egos is worse.
        maps: see `bridgegen.jobs.suite.maps.picture_payload`.
        code: characters that the page has besides its data.
    """
    labels = list(suite.labels)
    found = suite_difference(suite)
    by_entry: dict[str, dict[str, EntryResult]] = {}
    for result in suite.results:
        by_entry.setdefault(result.entry, {})[result.ego] = result
    criteria = _criteria(suite)
    motions, at = _motions(played)
    entries = [_entry(suite, name, of_it, labels, criteria, at) for name, of_it in by_entry.items()]
    complete = [_verdicts(suite, of_it) for of_it in by_entry.values()]
    page: dict[str, Any] = {
        "live": False,
        "summary": {"critical_distance": None, "hard_braking": HARD_BRAKING},
        "rows": {"columns": [], "evaluation": []},  # of a report; a suite has none
        "confirmations": [],
        "scale": {**SCALE, "road": ROAD_SCALE},
        "roads": [],
        "kept": [],
        "suite": {
            "name": suite.folder.resolve().name,
            "egos": labels,
            "headlines": [
                headline(suite.of_ego(ego), label)
                for ego, label in zip(suite.egos, labels, strict=True)
            ],
            "outcomes": [
                [text for text in (outcomes(suite.of_ego(ego)), points(suite.of_ego(ego))) if text]
                + suite.drawn_lines(ego)
                for ego in suite.egos
            ],
            "differences": differences([group for group in complete if len(group) > 1], labels),
            "changes": changes(found) if found else "",
            "changed": _changed(suite, found, list(by_entry), at) if found else None,
            "facts": _facts(suite),
            "entries": entries,
            "criteria": _matrix(suite, criteria),
            "searches": [_search(suite, search) for search in searches],
            "clauses": _clauses(suite),
            "maps": list(maps),
            "motions": motions,
        },
    }
    most = SIZE + SIZE_OF_RESULT * max(0, len(suite.results) - 1000)
    room = most - code - len(script_json(page))
    page["suite"]["details"] = _details(suite, by_entry, criteria, commands, room)
    return page


def _changed(
    suite: SuiteRun, found: Difference, entries: Sequence[str], at: Mapping[Played, int]
) -> dict[str, Any]:
    """Return the variations that change from the first ego to the second, and those that do not."""
    order = in_order(found)
    shown = [row for row in order if row.run][:MOST_CHANGES]
    results = [{one.entry: one for one in suite.of_ego(ego)} for ego in suite.egos]
    words = _Words()
    of = []
    for by_name in results:
        rows = [by_name[row.entry].rows[row.row] for row in shown]
        verdicts = {name: one.verdicts for name, one in by_name.items()}
        of.append(
            {
                "v": "".join(_LETTER[verdicts[row.entry][row.row]] for row in shown),
                "severity": [_short(row.severity) for row in rows],
                "what": words.at(_happens(row) for row in rows),
            }
        )
    motions = [at.get((row.entry, suite.egos[1], row.row), -1) for row in shown]
    silent = Counter(
        row.kind
        for row in order
        if row.kind in KINDS[:4] and (row.entry, suite.egos[1], row.row) not in at
    )
    table = {
        "entry": [entries.index(row.entry) for row in shown],
        "row": [row.row for row in shown],
        "kind": [KINDS.index(row.kind) for row in shown],
        "of": of,
        "motion": motions,
        "words": list(words.number),
    }
    return {
        "headline": found.headline,
        "kinds": list(found.kinds.items()),
        "silent": list(silent.items()),
        "unlisted": len(order) - len(shown),
        "rows": _packed(table),
    }


def _happens(row: RowResult) -> str:
    """Return the conflict of a variation that counts, its type, and with whom, a line each."""
    some = (row.conflict, row.conflict_type, row.partner)
    return "\n".join(some) if row.conflict in _HAPPENED else ""


def _verdicts(suite: SuiteRun, of_it: Mapping[str, EntryResult]) -> list[Verdict]:
    return [of_it[ego].verdict for ego in suite.egos if ego in of_it]


# ---- entries ----


def _entry(
    suite: SuiteRun,
    name: str,
    of_it: Mapping[str, EntryResult],
    labels: Sequence[str],
    criteria: Mapping[str, int],
    at: Mapping[Played, int],
) -> dict[str, Any]:
    """Return a line of the table."""
    verdicts = _verdicts(suite, of_it)
    whole = len(verdicts) == len(labels)
    return {
        "name": name,
        "title": next((result.title for result in of_it.values() if result.title), ""),
        "differ": difference(verdicts, labels) if whole else "",
        "results": [
            _result(suite, of_it[ego], criteria, at.get((name, ego, of_it[ego].worst or 0)))
            if ego in of_it
            else None
            for ego in suite.egos
        ],
    }


def _result(
    suite: SuiteRun, entry_result: EntryResult, criteria: Mapping[str, int], motion: int | None
) -> dict[str, Any]:
    """Return a cell of the table; what is absent is not said."""
    found: dict[str, Any] = {
        "v": _LETTER[entry_result.verdict],
        "n": [n for v in _LETTER if (n := entry_result.count(v)) or v != "flaky"],
    }
    lost = entry_result.problem or next(
        (row.problem for row in entry_result.rows if row.problem), ""
    )
    if lost or not entry_result.rows:
        found["problem"] = lost or "it has no variations"
    if entry_result.verdict == "not judged":
        found["unjudged"] = entry_result.unjudged
    blameless = sum(row.verdict == "passed" and row.collisions > 0 for row in entry_result.rows)
    if blameless:
        found["blameless"] = blameless
    _, mitigated, unavoided = entry_result.outcomes().values()
    if mitigated or unavoided:
        found["hits"] = [mitigated, unavoided]
    if motion is not None:
        found["motion"] = motion
    if entry_result.worst is None:
        return found
    stated = suite.known_failures
    if said := words(stated.worst(entry_result), stated.failures.get(entry_result.entry)):
        found["standing"] = said
        found["excused"] = stated.worst(entry_result) in EXCUSED
        found["comment"] = stated.failures[entry_result.entry][1].comment
    row = entry_result.rows[entry_result.worst]
    found["severity"] = _short(
        max(result.severity for result in entry_result.rows if result.verdict == "failed")
    )
    if row.critical or row.conflict in _HAPPENED:
        found["conflict"] = [row.conflict, row.conflict_type, row.partner]
    violated = {
        i for each in entry_result.rows for i in each.violated if i < len(entry_result.criteria)
    }
    if violated:
        found["violated"] = [criteria[_text(entry_result.criteria[i])] for i in sorted(violated)]
    return found


# ---- criteria ----


def _search(suite: SuiteRun, worse_than: WorseThan) -> dict[str, Any]:
    report = worse_than.folder / "report.html"
    return {
        "entry": worse_than.entry,
        "worse": worse_than.worse,
        "evaluations": worse_than.evaluations,
        "sentence": worse_than.problem or worse_than.sentence,
        "problem": bool(worse_than.problem),
        "modes": list(worse_than.modes[:MOST_MODES]),
        "report": report.relative_to(suite.folder).as_posix() if report.exists() else "",
    }


def _text(criterion: Mapping[str, Any]) -> str:
    return json.dumps(criterion, sort_keys=True)


def _criteria(suite: SuiteRun) -> dict[str, int]:
    """Return all criteria with their numbers; the most severe, then the most violated first."""
    seen: dict[str, int] = {}
    for result in suite.results:
        for i, criterion in enumerate(result.criteria):
            text = _text(criterion)
            seen[text] = seen.get(text, 0) + sum(i in row.violated for row in result.rows)

    def order(text: str) -> tuple[bool, int, int, str]:
        criterion = json.loads(text)
        severe = _SEVERITIES.index(criterion.get("severity", "major"))
        return not seen[text], severe, -seen[text], str(criterion["id"])

    return {text: number for number, text in enumerate(sorted(seen, key=order))}


def _matrix(suite: SuiteRun, criteria: Mapping[str, int]) -> list[dict[str, Any]]:
    """Return each criterion with how many entries and variations violate it, by ego."""
    found: list[dict[str, Any]] = [
        {"severity": "major", "text": "", **json.loads(text), "of": []} for text in criteria
    ]
    for ego in suite.egos:
        of = [{"entries": [0, 0, 0], "rows": [0, 0, 0]} for _ in criteria]
        for result in suite.of_ego(ego):
            for i, criterion in enumerate(result.criteria):
                known = [
                    row.margins[i]
                    for row, verdict in zip(result.rows, result.verdicts, strict=True)
                    if i < len(row.margins) and verdict not in ("not judged", "flaky")
                ]
                violated = sum(margin < 0.0 for margin in known)
                table = of[criteria[_text(criterion)]]
                which = 0 if violated else 1 if known else 2
                table["entries"][which] += 1
                for k, n in enumerate(
                    (violated, len(known) - violated, len(result.rows) - len(known))
                ):
                    table["rows"][k] += n
        for criterion, table in zip(found, of, strict=True):
            criterion["of"].append(table)
    return found


def _clauses(suite: SuiteRun) -> list[dict[str, Any]]:
    """Return each clause of a regulation with what each ego makes of it."""
    by_ego = [clause_results(suite.results, ego) for ego in suite.egos]
    found: dict[str, dict[str, Any]] = {}
    for e, clauses in enumerate(by_ego):
        for clause in clauses:
            shown = {"id": clause.id, "text": clause.text, "entries": clause.entries, "of": {}}
            found.setdefault(clause.id, shown)["of"][str(e)] = {
                "v": _LETTER[clause.verdict],
                "words": clause_in_words(clause),
                "rows": [clause.passed, clause.failed, clause.not_run, clause.not_applicable],
            }
    left = [
        {"id": id, "text": f"{text}. Not answered: {why}", "entries": (), "of": {}}
        for id, text, why in suite.unanswered
    ]
    return [*found.values(), *left]


def _facts(suite: SuiteRun) -> list[str]:
    """Return what the results depend on, where it is not the default; and how failures stand."""
    s = suite.settings
    facts = [f"simulator {s['simulator']}"] if s.get("simulator", "embedded") != "embedded" else []
    for name in ("critical", "count", "others", "empty_trigger"):
        facts += [f"{name.replace('_', ' ')}: {s[name]}"] if s.get(name) else []
    if odd := s.get("odd"):
        facts.append(f"operational design domain {Path(odd['path']).name}")
    facts += [f"ideal {', '.join(map(str, s['ideal']))}"] if s.get("ideal") else []
    facts += [f"seed {s['seed']}"] if s.get("seed") else []
    for ego, label in zip(suite.egos, suite.labels, strict=True):
        if sentence := suite.known_failures.sentence(suite.of_ego(ego)):
            facts.append(f"{label}: {sentence}" if len(suite.egos) > 1 else sentence)
    return facts


# ---- details ----


class _Words:
    """The different texts of an entry, each once."""

    def __init__(self) -> None:
        self.number: dict[str, int] = {"": 0}

    def at(self, texts: Iterable[str]) -> list[int]:
        return [self.number.setdefault(text, len(self.number)) for text in texts]


def _details(
    suite: SuiteRun,
    by_entry: Mapping[str, Mapping[str, EntryResult]],
    criteria: Mapping[str, int],
    commands: Mapping[Key, str],
    room: int,
) -> list[str]:
    """Return each entry's variations, deflated; as many as there is room for."""
    most = min(MOST_ROWS, max((len(result.rows) for result in suite.results), default=0))
    while True:
        texts = [
            _packed(_of_entry([of_it.get(ego) for ego in suite.egos], criteria, commands, most))
            for of_it in by_entry.values()
        ]
        size = sum(len(text) + 3 for text in texts)
        if size <= room or most == 0:
            return texts
        most = min(most - 1, int(most * 0.9 * max(room, 0) / size))


def _packed(value: Any) -> str:
    return deflated(json.dumps(value, allow_nan=False, separators=(",", ":")).encode())


def _of_entry(
    results: Sequence[EntryResult | None],
    criteria: Mapping[str, int],
    commands: Mapping[Key, str],
    most: int,
) -> dict[str, Any]:
    """Return what the page shows of an entry when it is opened."""
    words = _Words()
    same = len({len(result.rows) for result in results if result is not None and result.rows}) == 1
    found: dict[str, Any] = {"results": []}
    for result in results:
        if result is None:
            found["results"].append(None)
            continue
        verdicts = [_LETTER[verdict] for verdict in result.verdicts]
        ranks = [
            ("fynup".index(v), *rank(row)) for v, row in zip(verdicts, result.rows, strict=True)
        ]
        kept = sorted(range(len(result.rows)), key=lambda i: (*ranks[i], i))[:most]
        rows = [result.rows[i] for i in kept]
        colours = colours_of(result)
        found["results"].append(
            {
                "driver": result.driver,
                "files": [file for file in (result.scenario, result.distribution) if file],
                "notes": result.notes,
                "command": commands.get(key_of(result), ""),
                "worst": result.worst,
                "parameters": list(zip(result.parameters, result.units, strict=False)),
                "criteria": [criteria[_text(criterion)] for criterion in result.criteria],
                "total": len(result.rows),
                "at": kept,
                "verdict": "".join(verdicts[i] for i in kept),
                "critical": "".join("01"[row.critical] for row in rows),
                "x": _columns([row.x for row in rows], len(result.parameters)),
                "margins": _columns([row.margins for row in rows], len(result.criteria)),
                "severity": [_short(row.severity) for row in rows],
                "d_min": [_short(row.d_min) for row in rows],
                "outcome": "".join(_OUTCOME[row.outcome] for row in rows),
                "impact": [_short(row.impact_speed) for row in rows],
                "relative": [_short(row.relative_impact_speed) for row in rows],
                "colour": words.at(colours[i] or "" for i in kept),
                "conflict": words.at(row.conflict for row in rows),
                "type": words.at(row.conflict_type for row in rows),
                "partner": words.at(row.partner for row in rows),
                "responsible": words.at(row.responsible for row in rows),
                "note": words.at(
                    row.problem or row.flaky or row.implausible or row.unjudged for row in rows
                ),
                "beside": _beside(results, result, kept) if same else [],
            }
        )
    found["words"] = list(words.number)
    return found


def _columns(rows: Sequence[Sequence[float | str]], width: int) -> list[list[float | str | None]]:
    """Return columns of rows; None where a row is shorter."""
    return [[_short(row[k]) if k < len(row) else None for row in rows] for k in range(width)]


def _beside(
    results: Sequence[EntryResult | None], entry_result: EntryResult, kept: Sequence[int]
) -> list[str]:
    """Return the verdicts of all egos on the same variations, a letter each."""
    verdicts = [[] if other is None else other.verdicts for other in results]
    return (
        [
            "".join(
                _LETTER[theirs[i]]
                if other is not None
                and i < len(other.rows)
                and other.rows[i].x == entry_result.rows[i].x
                else "-"
                for other, theirs in zip(results, verdicts, strict=True)
            )
            for i in kept
        ]
        if len(results) > 1
        else []
    )


def _short(value: float | str | None) -> float | str | None:
    """Return a number with six significant digits, which keep its sign; None if not finite."""
    if value is None or isinstance(value, str):
        return value
    return float(f"{value:.6g}") if math.isfinite(value) else None


# ---- playbacks ----


def _motions(played: Sequence[Motion]) -> tuple[dict[str, Any], dict[Played, int]]:
    """Return the playbacks, deflated, with their roads, each road once; and which is whose."""
    roads: list[str] = []
    number: dict[Any, int] = {}
    names, on, texts = list[str](), list[int](), list[str]()
    at: dict[Played, int] = {}
    room = MOTIONS
    for motion in played:
        playback, twin = motion.playback, motion.twin
        road = road_key(playback)
        new = "" if road in number else _packed(road_payload(playback))
        whole = _plain(playback)
        if twin is not None:
            # Of one row in one storyboard: bodies, road and clock are the same.
            whole |= {"twin": _plain(twin), "diverged": diverged_at(twin, playback)}
        text = _packed(whole)
        if len(new) + len(text) > room:
            continue
        room -= len(new) + len(text)
        if road not in number:
            number[road] = len(roads)
            roads.append(new)
        at |= {(motion.entry, ego, motion.row): len(texts) for ego in motion.egos}
        names.append(playback.name)
        on.append(number[road])
        texts.append(text)
    return {"names": names, "roads": roads, "on": on, "texts": texts}, at


def _plain(playback: Playback) -> dict[str, Any]:
    whole = playback_payload(playback, 0, None)
    return {name: value for name, value in whole.items() if name not in OF_ROW}
