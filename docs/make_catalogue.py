"""Write catalogue.md and its pictures: what ships, and the measures of the road templates.

Run it after a change to the catalogue: ``python docs/make_catalogue.py``.
"""

from pathlib import Path

from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.scenario_page import story_lines
from bridgegen.pages.sketch import sketch
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.language.roads import KNOBS
from bridgegen.scenario.typology import said, typologies

HERE = Path(__file__).parent
PICTURES = HERE / "catalogue"

HEAD = """\
# The catalogue

Logical scenarios that ship. Each picture shows the defaults at the moment of the closest approach,
with the scenario's own ego driver; dashed outlines are the start positions. Search one with
`bridgegen search NAME`, draw it with all its parameters, constraints and sources with
`bridgegen draw NAME`, start your own from it with `bridgegen new MINE --like NAME`.

<!-- Written by docs/make_catalogue.py. -->
"""

TEMPLATES = """
## Road templates

`template:` says what kind of road network a scenario takes place on, `roads:` gives its measures: a
number, or the name of a parameter of the static axis. A static parameter of a measure's own name
needs no mention. Besides, junctions have `legs` (`heading`, `lanes_in`, `lanes_out`, `turns`,
`sign`, `crosswalk`), `crosswalks` and `signals`; a road may have `segments` and `crosswalk_at`.
"""


TYPES = """
## Types of crashes

Which types of crashes the scenarios realise, by published typologies, with the share of crashes
that each type is. A scenario is one way in which a type happens, so a type that has one is not
thereby tested; in some the ego is the one that errs, in others the other participant.
`bridgegen list scenarios --typology` also names the types that no scenario realises. Figures that
could not be read are not given, and none is estimated.
"""


def crash_types() -> str:
    """Return the section on types of crashes."""
    parts = [TYPES]
    for typology in typologies().values():
        rows = "\n".join(
            f"| {kind.name} | {'' if kind.percent is None else f'{kind.percent:g} %'} | "
            f"`{name}`: {why} |"
            for kind in typology.covered
            for name, why in kind.scenarios.items()
        )
        parts.append(
            f"### {typology.title}\n\n{said(typology)[0].upper()}{said(typology)[1:]}. Shares of: "
            f"{typology.counts}. Source: {typology.source}. How the figures are known: "
            f"{typology.known}.\n\n| type | share | scenario |\n|---|---|---|\n{rows}\n"
        )
    return "\n".join(parts)


def catalogue() -> str:
    """Return catalogue.md."""
    parts = [HEAD]
    for name in names():
        scenario = load(name)
        story = "\n".join(f"- {line}" for line in story_lines(scenario))
        parts.append(
            f"## {scenario.title}\n\n`{name}`, {scenario.roads.template}, ego "
            f"{scenario.driver}\n\n![{scenario.title}](catalogue/{name}.svg)\n\n"
            f"{' '.join(scenario.description.split())}\n\n{story}\n\n"
            f"Source: {' '.join(scenario.source.split())}\n"
        )
    parts += [crash_types(), TEMPLATES]
    for template, knobs in KNOBS.items():
        rows = "\n".join(
            f"| `{name}` | {one.unit} | {one.usual:g} | {one.low:g} to {one.high:g} | {one.why} |"
            for name, one in knobs.items()
        )
        head = "| measure | unit | usual | range | |\n|---|---|---|---|---|"
        parts.append(f"### {template}\n\n{head}\n{rows}\n")
    return "\n".join(parts)


def picture(name: str) -> str:
    """Return the picture of a scenario at its defaults, as SVG."""
    scenario = load(name)
    return sketch(Pipeline(scenario, scenario.space()).runner)


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    (HERE / "catalogue.md").write_text(catalogue(), "utf-8")
    for each in names():
        (PICTURES / f"{each}.svg").write_text(picture(each), "utf-8")
