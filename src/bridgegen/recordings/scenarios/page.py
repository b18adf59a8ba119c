"""Mined scenarios on the page of recordings, in the terminal, and as plain data."""

from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path

from bridgegen.recordings.cells import html_table
from bridgegen.recordings.scenarios.draft import MinedRange
from bridgegen.recordings.scenarios.files import ENDINGS, FOLDER
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade
from bridgegen.scenario.exposure.page import facts, rate_text

_LINKS = ("scenario", "how well its distributions fit", "OpenSCENARIO distribution")


def scenarios_section(mined: Sequence[MinedScenario | Unmade]) -> str:
    """Return the cards of scenarios that were made, and why the others were not."""
    made = "".join(_card(one) for one in mined if isinstance(one, MinedScenario))
    lines = "".join(
        f"<li>{escape(one.source)}: {escape(one.reason)}</li>"
        for one in mined
        if isinstance(one, Unmade)
    )
    rest = f"<div class='card'><h3>Not made</h3><ul>{lines}</ul></div>" if lines else ""
    return made + rest


def _card(one: MinedScenario) -> str:
    head = ("parameter", "declared", "seen", "mined", "form", "")
    rows = [
        [f"{each.parameter} [{each.unit}]", *_ranges(each),
         one.fit.parameters[each.parameter].form, each.remark]
        for each in one.ranges
    ]  # fmt: skip
    known = "".join(f"<li>{escape(text)}</li>" for text in facts(one.fit))
    rules = "".join(f"<li>{escape(rule)}</li>" for rule in one.tightened)
    tightened = f"<p>Constraints added:</p><ul>{rules}</ul>" if rules else ""
    links = ", ".join(
        f"<a href='{FOLDER}/{escape(one.name)}{end}'>{text}</a>"
        for end, text in zip(ENDINGS, _LINKS, strict=True)
    )
    return (
        f"<div class='card' id='{escape(one.name)}'><h3>{escape(one.name)}</h3><ul>{known}</ul>"
        f"<div class='wide'>{html_table(head, rows)}</div>{tightened}<p>{links}</p></div>"
    )


def _ranges(one: MinedRange) -> list[str]:
    return [f"{each.low:g} to {each.high:g}" for each in (one.declared, one.seen, one.mined)]


def made_row(one: MinedScenario) -> tuple[str, int, str, str]:
    """Return what the terminal shows of a scenario."""
    met = one.fit.exposure.encounters
    rate = met.per_hour if met else None
    beyond = [each.parameter for each in one.ranges if each.remark]
    return (
        one.name, one.fit.used, rate_text(rate, "h") if rate else "–", ", ".join(beyond) or "–",
    )  # fmt: skip


def made_as_json(one: MinedScenario | Unmade, out: Path) -> dict[str, object]:
    """Return a scenario as plain data, or why there is none."""
    if isinstance(one, Unmade):
        return {"of": one.source, "scenario": None, "reason": one.reason}
    met = one.fit.exposure.encounters
    return {
        "of": one.source, "scenario": str(out / FOLDER / f"{one.name}{ENDINGS[0]}"), "reason": None,
        "events": one.fit.used, "encounters": asdict(met) if met else None,
        "ranges": [asdict(each) for each in one.ranges], "tightened": one.tightened,
    }  # fmt: skip
