"""The report's data as the JSON that the page reads.

Numbers in bulk are rounded to what a screen can show; the exported files keep every bit. A
number that is NaN or infinite becomes null.
"""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool
from bridgegen.base.physics import HARD_BRAKING
from bridgegen.pages import convergence, sentences
from bridgegen.pages.confirmation_payload import margins_shown
from bridgegen.pages.data import WHOLE, Column, Evaluations, ReportData
from bridgegen.pages.findings_payload import findings_payload, implausible_payload
from bridgegen.pages.packed import deflated, packed_files, packed_motions, road_key
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.playback_payload import ROAD_SCALE, SCALE, playback_payload, road_payload
from bridgegen.pages.sections import sections_payload
from bridgegen.pages.series import significant
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.search.algorithms.dominance import by_merit, non_dominated

# What limits motions is time rather than room, 0.9 to 1.4 ms each; all of 1,000 evaluations would
# take two seconds more.
SIZE, SIZE_OF_ROW = 950_000, 500
"""Maximum number of characters of a page with 1000 evaluations, and how many more it may have for
each further one: motions fill what the rest leaves. Exported scenarios have their place anyway."""

ROWS = 20_000
"""Maximum number of rows on the page, evenly spread; the iterations include all rows."""


def to_json(
    data: ReportData,
    *,
    live: bool = False,
    code: int = 0,
    also: Mapping[str, Any] | None = None,
) -> str:
    """Return the page's data as JSON that is safe inside a ``<script>`` element.

    Args:
        data: of the report.
        live: whether the page may request updates from its server.
        code: see `payload`.
        also: what it holds besides, by key.
    """
    return script_json({**payload(data, code), "live": live, **(also or {})})


def script_json(value: Any) -> str:
    r"""Return plain data as JSON that is safe inside a ``<script>`` element.

    Every ``<`` is written as ``\u003c``, so that no text in it can close the element or open a
    comment; everything that is not ASCII is escaped, so that lone surrogates (from file names)
    do not break the encoding.
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    # A name in the data may hold "</script>" or "<!--", which would end the element whatever the
    # JSON around it.
    return text.replace("<", "\\u003c")


def payload(data: ReportData, code: int = 0) -> dict[str, Any]:
    """Return the page's data as plain dicts, lists, numbers and strings.

    Args:
        data: of the report.
        code: characters that the page has besides its data.
    """
    played = (*data.drawn, *data.kept)
    pictured = [playback for playback in played if playback.picture is not None]
    number = {playback.name: k for k, playback in enumerate(pictured)}
    roads: list[list[dict[str, Any]]] = []
    index: dict[tuple[tuple[str, bytes], ...], int] = {}
    kept = []
    for playback in played:
        key = road_key(playback)
        if key not in index:
            index[key] = len(roads)
            roads.append(road_payload(playback))
        kept.append(playback_payload(playback, index[key], number.get(playback.name)))
    wanted = [item.evaluation for item in data.kept]
    wanted += [scenario.evaluation for each in data.confirmations for scenario in each.scenarios]
    modes = data.triage.modes if data.triage else ()
    wanted += [mode.shown for mode in modes]
    wanted += [criterion.at - 1 for criterion in data.criteria if criterion.at is not None]
    shown = _shown(data.evaluations, wanted)
    if data.alone:
        shown = np.isin(np.arange(shown.size), wanted[:1])
    page = {
        "live": False,
        "alone": data.alone,
        "summary": _summary(data),
        **_of_rows(data, shown),
        "minimal": packed_motions(data.minimal, index, SIZE, of_rows=False),
        "implausible": implausible_payload(data.evaluations.findings),
        "scale": {**SCALE, "road": ROAD_SCALE},
        "roads": roads,
        "kept": kept,
        "files": packed_files(data.files),
        "simulation": _simulation(data, shown),
        "pictures": pictures_payload([p.picture for p in pictured if p.picture]),
    }
    most = SIZE + SIZE_OF_ROW * max(0, data.evaluations.status.size - 1000)
    # Motions come last, and fill what is left: exported scenarios have their place anyway.
    room = max(0, most - code - len(script_json(page)))
    page["packed"] = motions = packed_motions(data.more, index, room, of_rows=True)
    if not shown[motions["evaluations"]].all():  # of a long run
        shown = _shown(data.evaluations, wanted + motions["evaluations"])
        page |= _of_rows(data, shown) | {"simulation": _simulation(data, shown)}
    return page


def _simulation(data: ReportData, shown: Bool) -> dict[str, Any] | None:
    """Return what the page simulates with, and its rows' values with all their bits."""
    if data.simulation is None or "refused" in data.simulation:
        return None if data.simulation is None else dict(data.simulation)
    columns = [column for column in data.evaluations.parameters if column.searched]
    values = np.stack([column.values[shown] for column in columns], axis=1)
    rows = {"names": [column.name for column in columns], "data": deflated(values.tobytes())}
    return {**data.simulation, "rows": rows}


def _of_rows(data: ReportData, shown: Bool) -> dict[str, Any]:
    """Return what the page holds of some rows, and the sections."""
    rows = _rows(data.evaluations, shown, harm=_harm_of(data))
    return {"rows": rows, **sections_payload(data, shown)}


def news(data: ReportData, after: int) -> dict[str, Any]:
    """Return the update for a page that holds the first ``after`` evaluations.

    It has the new rows, and the ranks of all; or all rows again (``whole``) where a long run is
    thinned. Everything else is complete; the sections' data are under ``sections``.
    """
    e, harm = data.evaluations, _harm_of(data)
    shown = _shown(e, [])
    whole = e.status.size > ROWS
    new = shown if whole else shown & (np.arange(shown.size) >= after)
    return {
        "summary": _summary(data),
        "whole": whole,
        "rows": {
            **_rows(e, new, harm=harm),
            "rank": _ranks(e, shown, harm=harm),
            "front": _front(e, shown),
        },
        "implausible": implausible_payload(e.findings),
        "sections": sections_payload(data, shown, grown=True),
    }


def _summary(data: ReportData) -> dict[str, Any]:
    s = data.summary
    baseline = [f"worse than {s.baseline}"] if s.baseline else []
    return {
        "title": s.title,
        "description": s.description,
        "facts": [
            s.scenario,
            *filter(None, [s.odd]),
            s.road,
            f"ego {s.ego}",
            *baseline,
            s.algorithm,
            f"seed {s.seed}",
        ],
        "finished": s.finished,
        "budget": int(s.budget),
        "critical_rule": s.critical_rule,
        "sentences": sentences.sentences(data),
        "table": sentences.summary_table(data),
        "provenance": sentences.provenance(s),
        "command": s.command,
        "view": s.view,
        "next": s.keep,
        "beside": data.beside,
        "critical_distance": _number(s.critical_distance),
        "hard_braking": HARD_BRAKING,
        "harm": s.harm,
    }


def _shown(e: Evaluations, kept: list[int]) -> Bool:
    """Return which rows the page holds, ``(N,)``: no failed ones, and of a long run a sample."""
    ok: Bool = e.status == 0
    if ok.size > ROWS:
        some = np.zeros(ok.size, dtype=np.bool_)
        # Evenly over the run, not at random: the same page for the same run.
        some[np.linspace(0, ok.size - 1, ROWS).round().astype(np.int64)] = True
        some[kept] = True
        ok &= some
    return ok


def _harm_of(data: ReportData) -> str | None:
    """Return the harm by which scenarios are ranked; None where only the objectives rank them."""
    return None if data.summary.criteria else data.summary.harm


def _rows(e: Evaluations, ok: Bool, *, harm: str | None = "") -> dict[str, Any]:
    groups = [("parameter", e.parameters), ("metric", e.metrics), ("objective", e.objectives)]
    return {
        "n": int(e.status.size),
        "n_failed": int(np.count_nonzero(e.status)),
        "n_critical": int(np.count_nonzero(e.critical & (e.status == 0))),
        "evaluation": np.flatnonzero(ok).tolist(),
        "iteration": (e.iteration[ok] + 1).tolist(),
        "critical": e.critical[ok].astype(np.int64).tolist(),
        "cause": None if e.cause is None else e.cause[ok].tolist(),
        "findings": findings_payload(e.findings, ok) if e.findings else None,
        "rank": _ranks(e, ok, harm=harm),
        "front": _front(e, ok),
        "columns": [_column(c, group, ok) for group, columns in groups for c in columns],
        "telling": convergence.telling_parameters(e.parameters, e.critical, ok),
    }


def _ranks(e: Evaluations, ok: Bool, *, harm: str | None = "") -> list[int]:
    """Return each row's place among all critical ones, 1 for the most critical; 0 for others.

    Where pass criteria make a scenario critical (no harm, None), the objectives decide. Else no
    near miss is above a contact: by harm where that makes a scenario critical, else by whether
    there is a collision. Then the severity decides, then the objectives.
    """
    critical = np.flatnonzero(e.critical & (e.status == 0))
    rank = np.zeros(e.critical.size, dtype=np.int64)
    F = (
        np.stack([c.whole[critical] for c in e.objectives], axis=1)
        if e.objectives
        else np.zeros((critical.size, 1))
    )
    measured = {c.name: c.whole[critical] for c in e.metrics if c.name in WHOLE}
    if harm == "" and "n_collision" in measured:
        measured["n_collision"] = np.minimum(measured["n_collision"], 1.0)  # whether, not how many
    order = by_merit(F)
    for name in () if harm is None else ("severity", harm or "n_collision"):
        if name in measured:
            # Stable sorts, the least important key first.
            order = order[np.argsort(-measured[name][order], kind="stable")]
    order = critical[order]
    rank[order] = np.arange(1, critical.size + 1)
    shown: list[int] = rank[ok].tolist()
    return shown


def _front(e: Evaluations, ok: Bool) -> list[int]:
    """Return the indices, among the rows shown, of the non-dominated ones.

    Empty unless there are several objectives.
    """
    if len(e.objectives) < 2 or not ok.any():
        return []
    F = np.stack([c.values[ok] for c in e.objectives], axis=1)
    places: list[int] = np.flatnonzero(non_dominated(F)).tolist()
    return places


def _column(column: Column, group: str, ok: Any) -> dict[str, Any]:
    return {
        "name": column.name,
        "unit": column.unit,
        "group": group,
        "description": column.description,
        "low": _number(column.low),
        "high": _number(column.high),
        "searched": column.searched,
        **column.labels,
        "values": _values(column, ok),
    }


def _values(column: Column, ok: Any) -> list[float | None]:
    values = column.values[ok]
    return margins_shown(values) if column.name.startswith(PREFIX) else significant(values)


def _number(value: float | None) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return float(value)
