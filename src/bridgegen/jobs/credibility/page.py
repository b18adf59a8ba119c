"""A dossier as one offline page without scripts: verdict, chapters, gaps, runs and files."""

import hashlib
from collections.abc import Iterator, Mapping

from bridgegen.jobs.credibility.measured import FEWEST
from bridgegen.jobs.credibility.model import FILE, Dossier, Item
from bridgegen.pages import templates
from bridgegen.pages.templates import Banner, Cell, counted

PAGE = "credibility.html"
GENERATOR = "bridgegen credibility"

SUITE = ("all.bits_different", "all.cases_wrong", "all.cases_bits")
"""Numbers that must be 0, or nothing else counts."""

MOST_FLIPS = 30
"""Largest number of evaluations that the page names as depending on the time step."""

_KINDS = {
    "filled": "state ok",
    "partly": "state open",
    "stated": "state ok",
    "yours": "state open",
    "gap": "state bad",
}
_VERDICTS = {"accepted": "state ok", "not accepted": "state bad"}
_MEANING = {
    "filled": "by figures that a script recomputes, or by the installed package",
    "partly": "in part; the reason stands below it",
    "stated": "by people, in yours.yaml",
    "yours": "people have yet to fill it",
    "gap": "nothing here fills it",
}


def worst(dossier: Dossier) -> str:
    """Return the dossier in two sentences, the worst thing first."""
    figures = dossier.figures
    value = {one.id: float(one.value) for one in dossier.numbers if one.id in SUITE}
    status = (
        f"{figures['filled']:,.0f} items are filled by figures, {figures['partly']:,.0f} partly; "
        f"{figures['yours']:,.0f} are yours to fill, {figures['gap']:,.0f} are gaps."
    )
    return f"{next(_worst(dossier, value))} {status}"


def _worst(dossier: Dossier, suite: Mapping[str, float]) -> Iterator[str]:
    figures, different = dossier.figures, suite["all.bits_different"]
    if wrong := suite.get("all.cases_wrong"):
        has = "has a wrong answer" if wrong == 1 else "have wrong answers"
        yield f"{counted(int(wrong), 'case')} of the validation suite (5.4) {has}: rest nothing " \
              "on this installation."  # fmt: skip
    if different or suite.get("all.cases_bits"):
        yield "This machine does not give the published bits."
    if dossier.unread:
        yield f"{counted(dossier.unread, 'run')} of {dossier.unread + len(dossier.runs):,} could " \
              "not be read."  # fmt: skip
    if refused := int(figures["refused"]):
        yield f"Simulation and real tests differ by more than is accepted in {refused:,} of " \
              f"{counted(len(dossier.comparisons), 'comparison')}."  # fmt: skip
    flips, findings = int(figures["flips"]), int(figures["findings"])
    if flips:
        yield f"{flips:,} of {counted(findings, 'finding')} {'hangs' if flips == 1 else 'hang'} " \
              "on the time step."  # fmt: skip
    if samples := int(figures["sample_flips"]):
        yield f"{counted(samples, 'evaluation')} without failure " \
              f"{'hangs' if samples == 1 else 'hang'} on the time step."  # fmt: skip
    yield (
        "No finding hangs on the time step."
        if findings
        else "No finding was simulated at a finer time step."
    )


def page(dossier: Dossier, data: bytes) -> bytes:
    """Return the page of a dossier.

    Args:
        dossier: it.
        data: its JSON file, whose digest the page states.
    """
    figures = dossier.figures
    bad = dossier.unread or figures["flips"] or figures["refused"]
    missing = figures["yours"] or figures["gap"]
    kind, word = ("open", "INCOMPLETE") if bad or missing else ("passes", "COMPLETE")
    if any(one.value for one in dossier.numbers if one.id in SUITE):
        kind, word = "fails", "FAILS"
    name = {run.id: f"{run.scenario} with {run.ego}" for run in dossier.runs}
    text = {number.id: number.text for number in dossier.numbers}
    return templates.page(
        "jobs/credibility/page.html",
        title="Credibility of the toolchain",
        verdict=Banner(worst(dossier), kind, word),
        dossier=dossier,
        generator=GENERATOR,
        legend=[(status, _KINDS[status], text) for status, text in _MEANING.items()],
        chapters=[
            (number, title, [_row(item) for item in dossier.items if _chapter(item) == number])
            for number, title in dossier.chapters.items()
        ],
        flips=[
            (
                Cell(f"{flip.run}, evaluation {flip.evaluation:,}", (name[flip.run],)),
                "finding" if flip.is_finding else "without failure",
                flip.text,
            )
            for flip in dossier.flips[:MOST_FLIPS]
        ],
        compared=[
            (
                Cell(f"{one.run}, {one.series}", (name[one.run],)),
                f"{one.quantity} [{one.unit}]",
                Cell(f"{one.tests:,}", (f"fewer than {FEWEST}",) if one.tests < FEWEST else ()),
                *(text.get(f"all.{of}:{k}", "–") for of in ("measured_mean", "simulated_mean")),
                Cell(
                    text.get(f"all.area:{k}", "–"),
                    (" to ".join(text.get(f"all.area_{end}:{k}", "–") for end in ("low", "high")),),
                ),
                "–" if one.threshold is None else f"{one.threshold:g}",
                Cell(one.verdict, kind=_VERDICTS.get(one.verdict, "state open")),
            )
            for k, one in enumerate(dossier.comparisons[:MOST_FLIPS], start=1)
        ],
        more_flips=len(dossier.flips[MOST_FLIPS:]),
        gaps=[(gap.place, Cell(gap.why, code=gap.command)) for gap in dossier.gaps],
        runs=[
            (
                Cell(run.id, (run.folder,)),
                f"{run.scenario} with {run.ego}",
                f"{run.algorithm}, seed {run.seed}",
                run.version,
                Cell("", code=dossier.commands[run.id]),
            )
            for run in dossier.runs
        ],
        evidence=[
            (Cell(one.file, (f"{one.bytes:,} bytes",)), one.shows, Cell("", code=one.sha256))
            for one in dossier.evidence
        ],
        file=FILE,
        digest=hashlib.sha256(data).hexdigest(),
    )


def _chapter(item: Item) -> str:
    return item.id.partition(".")[0]


def _row(item: Item) -> tuple[Cell, Cell, Cell, Cell]:
    """Return an item as a row: what it is, its status, what it says, and how to see that again."""
    asked = "asked by " + ", ".join(item.sources) if item.sources else ""
    return (
        Cell(f"{item.id} {item.title}", (asked,)),
        Cell(item.status, (item.note,) if item.note else (), kind=_KINDS[item.status]),
        Cell(item.claim.text, [line.text for line in item.details]),
        Cell(item.how, code=item.again),
    )
