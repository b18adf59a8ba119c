"""Pages of a logical scenario and of an ontology file, with what happens in sentences."""

from collections.abc import Iterator
from pathlib import Path

from markupsafe import Markup

from bridgegen.base.disk import refuse_other
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.convert import scenario_of
from bridgegen.pages import templates
from bridgegen.pages.build import critical_in_words
from bridgegen.pages.page import write_page
from bridgegen.pages.painter import paint
from bridgegen.pages.payload import script_json
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.sketch import sketch
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import (
    CONDITIONS,
    ConditionSpec,
    EventSpec,
    Jam,
    Participant,
    RoadWorks,
    Waypoint,
    beside,
    in_words,
)
from bridgegen.scenario.named_models import type_of
from bridgegen.scenario.ontology.check import check, constraints_in_words
from bridgegen.scenario.ontology.files import load

# --- What happens in a logical scenario, in sentences ---


def story_lines(scenario: LogicalScenario) -> Iterator[str]:
    """Yield the participants, then the events."""
    jammed = {name for jam in scenario.story.jams for name in jam.participants}
    for one in scenario.participants:
        if one.name not in jammed:
            yield _participant(one, scenario)
    yield from (_jam(jam, scenario) for jam in scenario.story.jams)
    yield from (_works(works) for works in scenario.story.works)
    yield from (_event(event) for event in scenario.events)


def _participant(one: Participant, scenario: LogicalScenario) -> str:
    who, speed = f"{one.name}, {_kind(one)}", in_words(one.speed, "m/s")
    extra = ", with blue light and siren on" if one.siren else ""
    if one.exceeds_limit:
        extra += f", faster than allowed if need be ({one.exceeds_limit})"
    if one.path:
        start, *between, end = map(_place, one.path)
        past, how = ("past", ", a smooth curve,") if one.conduct == "vehicle" else ("via", "")
        way = "".join(f"; {past} {place}" for place in between) + (";" if between else "")
        path = f"its path{how} leads from {start}{way} to {end}"
        return f"{who}, starts at {speed}{extra}; {path}."
    if one.ways:
        names = scenario.parameters[one.place_by].kind.names
        at = [f"from {_place(start)}{f' to {_place(end)}' if end else ''} ({name})"
              for name, (start, end) in zip(names, one.ways, strict=True)]  # fmt: skip
        return (
            f"{who}, starts at {speed}{extra}; {one.place_by} chooses its place: {'; '.join(at)}."
        )
    turned = ""
    if one.heading in (180.0, -180.0):
        turned = ", against the traffic"
    elif one.heading != 0.0:
        turned = f", turned by {in_words(one.heading, 'deg')}"
    if one.conduct == "obstacle" or (one.speed == 0.0 and one.end is None):
        return f"{who}, stands at {_place(one.start)}{turned}{extra}."
    goes = "" if one.end is None else f" and goes to {_place(one.end)}"
    return f"{who}, starts at {_place(one.start)} at {speed}{turned}{extra}{goes}."


def _kind(one: Participant) -> str:
    """Return what it is, with its article: all that it may be."""
    return " or ".join(map(_noun, one.types or (one.model or one.type,)))


def _noun(name: str) -> str:
    """Return a type's noun with its article, or a model's with its name."""
    kind = type_of(name)
    noun = "emergency vehicle" if kind == "emergency" else kind
    model = "" if kind == name else f" (model {name})"
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}{model}"


def _jam(jam: Jam, scenario: LogicalScenario) -> str:
    kinds = ", ".join(scenario.participant(name).type for name in jam.participants)
    return f"{jam.name}, a queue from its tail at {_place(jam.tail)}: {kinds}."


def _works(works: RoadWorks) -> str:
    return (
        f"{works.name}: {len(works.cones)} cones close {works.length:g} m from "
        f"{_place(works.start)} on, announced by a sign."
    )


def _event(event: EventSpec) -> str:
    what = " and ".join(map(str, event.actions))
    when = ", or ".join(
        " and ".join(_condition(one, event) for one in alternative) for alternative in event.when
    )
    return f"{event.name}: {event.participant or 'the weather'} {what} when {when}."


def _condition(one: ConditionSpec, event: EventSpec) -> str:
    kind = CONDITIONS[one.kind]
    whose = one.of or event.participant
    subject = f"the {kind.meaning}" if one.kind == "time" else f"{kind.meaning} of {whose}"
    if one.kind == "after":
        subject = f"the time since {one.event} ended"
    if one.kind == "began":
        subject = f"the time since {one.event} began"
    if one.kind == "contact":
        return f"{whose} has touched {one.to}"
    if one.to is not None:
        subject = f"the {one.kind} ({kind.meaning}) from {whose} to {one.to}"
    return f"{subject} is {kind.rule} {in_words(one.value, kind.unit)}"


def _place(at: Waypoint) -> str:
    lane = f"lane {at.lane}" if isinstance(at.lane, int) else f"the {at.lane}"
    where = f" of leg {at.leg} {at.way}"
    if at.leg == "main":
        where = "" if at.way == "out" else " of the oncoming side"
    aside = "" if at.offset == 0.0 else f", {beside(at.offset)} of its centre"
    return f"{in_words(at.distance, 'm')} on {lane}{where}{aside}"


def write_scenario_page(path: Path, scenario: LogicalScenario) -> None:
    """Write the page of a scenario, whole or not at all.

    Raises:
        StorageError: the file cannot be written.
    """
    pipeline, aim = Pipeline(scenario, scenario.space()), scenario.objective
    templates.write_page(
        path, "pages/web/scenario.html",
        title=f"{scenario.name}: {scenario.title}", generator=GENERATOR, scenario=scenario,
        facts=[
            scenario.name, f"template {scenario.roads.template}", f"ego {pipeline.driver.name}",
            f"{scenario.duration:g} s", f"searched: {', '.join(scenario.axes)}",
            f"critical: {critical_in_words(aim.rule, aim.count, aim.critical, aim.criteria)}",
        ],
        picture=Markup(sketch(pipeline.runner)),
        story=[*story_lines(scenario)],
        parameters=[_parameter(one) for one in scenario.parameters.values()],
        rules=(*scenario.bounds, *scenario.derived),
    )  # fmt: skip


def _parameter(one: Parameter) -> list[object]:
    unit = "" if one.unit in ("1", "count") else f" {one.unit}"
    return [
        one.name, one.axis, one.kind.span_text(one.low, one.high, "{:g}".format, unit),
        f"{one.kind.text(one.default, '{:g}'.format)}{unit}", (one.description, one.source),
    ]  # fmt: skip


# --- Pages of their own: an ontology file with violated constraints in red, a logical scenario ---


GENERATOR = "bridgegen show"
"""Generator that the pages of a scenario name."""


def show_scenario(name_or_path: str, out: Path | None = None) -> Path:
    """Draw a logical scenario as a page.

    Args:
        name_or_path: a name of the catalogue, or a scenario file.
        out: the page; by default with the scenario's name, beside its file or, of the catalogue,
            here.

    Raises:
        InputError: no such scenario, one that breaks a rule, or a page whose name does not end in
            .html.
        StorageError: the page cannot be written, or is something else already.
    """
    scenario = load_scenario(name_or_path)
    path = Path(name_or_path)
    beside = path.parent if path.suffix in (".yaml", ".yml") else Path()
    out = out or beside / f"{scenario.name}.html"
    refuse_other(out, GENERATOR, "picture")
    write_scenario_page(out, scenario)
    return out


def show_file(owl: Path, out: Path | None = None) -> tuple[Path, int]:
    """Draw an ontology file's individuals as a page.

    An ``.owl`` of a scenario of the catalogue is checked against that scenario's constraints, any
    other against the ranges that it declares itself.

    Args:
        owl: the file, as written or edited.
        out: the page; by default beside the file, with its name and ``.html``. An earlier picture
            is replaced, any other file is not.

    Returns:
        The page, and how many violations it shows.

    Raises:
        InputError: the page's name does not end in .html.
        FileFormatError: not an ontology that can be read.
        OntologyError: it cannot be checked.
        StorageError: the page cannot be written, or is something else already.
    """
    out = out or owl.with_suffix(".html")
    refuse_other(out, GENERATOR, "picture")
    individuals = load(owl)
    scenario = scenario_of(individuals)
    violations = check(individuals, scenario)
    one = paint(individuals, violations, constraints_in_words(scenario))
    title = f"{owl.name}: {one.name}" if one.name else owl.name
    write_page(out, "show.js", title, script_json(pictures_payload([one])))
    return out, len(violations)
