"""Pages of a logical scenario and of an ontology file, with what happens in sentences."""

import shlex
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from markupsafe import Markup

from bridgegen.base.disk import refuse_other
from bridgegen.base.errors import InputError
from bridgegen.base.physics import HARD_BRAKING
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.convert import scenario_of
from bridgegen.pages import templates
from bridgegen.pages.build import critical_in_words
from bridgegen.pages.page import scripted, write_page
from bridgegen.pages.painter import paint
from bridgegen.pages.payload import script_json
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.playback_payload import ROAD_SCALE, SCALE, playback_payload, road_payload
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.simulation_payload import simulation_payload
from bridgegen.pages.sketch import sketch
from bridgegen.scenario.countries import in_the_mirror
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import (
    CONDITIONS,
    GHOST_UNITS,
    TRACKER_UNITS,
    ConditionSpec,
    EventSpec,
    Ghost,
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
from bridgegen.scenario.ontology.mirror import mirrored

# --- What happens in a logical scenario, in sentences ---


def story_lines(scenario: LogicalScenario) -> Iterator[str]:
    """Yield the participants, then the events."""
    told = in_the_mirror if scenario.roads.left_hand else str
    yield from map(told, _lines(scenario))


def _lines(scenario: LogicalScenario) -> Iterator[str]:
    jammed = {name for jam in scenario.story.jams for name in jam.participants}
    for participant in scenario.participants:
        if participant.name not in jammed:
            yield _participant(participant, scenario)
    yield from (_jam(jam, scenario) for jam in scenario.story.jams)
    yield from (_works(works, scenario) for works in scenario.story.works)
    yield from (_ghost(ghost) for ghost in scenario.story.ghosts)
    if tracker := scenario.story.tracker:
        said = (f"{name} {in_words(value, TRACKER_UNITS[name])}" for name, value in tracker.items())
        yield f"The ego's tracks are late, and merge: {', '.join(said)}."
    yield from (_event(event) for event in scenario.events)


def _ghost(ghost: Ghost) -> str:
    said = (f"{name} {in_words(value, GHOST_UNITS[name])}" for name, value in ghost.numbers.items())
    where = f"as a mirror image of {ghost.mirrors}" if ghost.mirrors else "where nothing is"
    return f"{ghost.name}: the ego's sensors report a {ghost.type} {where} ({', '.join(said)})."


def _participant(participant: Participant, scenario: LogicalScenario) -> str:
    who, speed = f"{participant.name}, {_kind(participant)}", in_words(participant.speed, "m/s")
    extra = ", with blue light and siren on" if participant.siren else ""
    if participant.exceeds_limit:
        extra += f", faster than allowed if need be ({participant.exceeds_limit})"
    if participant.off_crosswalk:
        extra += f", away from crosswalks ({participant.off_crosswalk})"
    place = partial(_place, scenario.roads)
    if participant.path:
        start, *between, end = map(place, participant.path)
        past, how = (
            ("past", ", a smooth curve,") if participant.conduct == "vehicle" else ("via", "")
        )
        way = "".join(f"; {past} {place}" for place in between) + (";" if between else "")
        path = f"its path{how} leads from {start}{way} to {end}"
        return f"{who}, starts at {speed}{extra}; {path}."
    if participant.ways:
        names = scenario.parameters[participant.place_by].kind.names
        at = [
            f"from {place(start)}{f' to {place(end)}' if end else ''} ({name})"
            for name, (start, end) in zip(names, participant.ways, strict=True)
        ]
        return (
            f"{who}, starts at {speed}{extra}; {participant.place_by} chooses its place: "
            f"{'; '.join(at)}."
        )
    turned = ""
    if participant.heading in (180.0, -180.0):
        turned = ", against the traffic"
    elif participant.heading != 0.0:
        turned = f", turned by {in_words(participant.heading, 'deg')}"
    if participant.conduct == "obstacle" or (participant.speed == 0.0 and participant.end is None):
        return f"{who}, stands at {place(participant.start)}{turned}{extra}."
    goes = "" if participant.end is None else f" and goes to {place(participant.end)}"
    if participant.change:
        begin, by, *back = map(place, participant.change)
        goes += f", changing lanes between {begin} and {by}"
        goes += f", and back between {' and '.join(back)}" if back else ""
    return f"{who}, starts at {place(participant.start)} at {speed}{turned}{extra}{goes}."


def _kind(participant: Participant) -> str:
    """Return what it is, with its article: all that it may be."""
    return " or ".join(map(_noun, participant.types or (participant.model or participant.type,)))


def _noun(name: str) -> str:
    """Return a type's noun with its article, or a model's with its name."""
    kind = type_of(name)
    noun = "emergency vehicle" if kind == "emergency" else kind
    model = "" if kind == name else f" (model {name})"
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}{model}"


def _jam(jam: Jam, scenario: LogicalScenario) -> str:
    kinds = ", ".join(scenario.participant(name).type for name in jam.participants)
    return f"{jam.name}, a queue from its tail at {_place(scenario.roads, jam.tail)}: {kinds}."


def _works(works: RoadWorks, scenario: LogicalScenario) -> str:
    return (
        f"{works.name}: {len(works.cones)} cones close {works.length:g} m from "
        f"{_place(scenario.roads, works.start)} on, announced by a sign."
    )


def _event(event: EventSpec) -> str:
    what = " and ".join(map(str, event.actions))
    when = ", or ".join(
        " and ".join(_condition(spec, event) for spec in alternative) for alternative in event.when
    )
    return f"{event.name}: {event.participant or 'the weather'} {what} when {when}."


def _condition(condition_spec: ConditionSpec, event: EventSpec) -> str:
    kind = CONDITIONS[condition_spec.kind]
    whose = condition_spec.of or event.participant
    subject = (
        f"the {kind.meaning}" if condition_spec.kind == "time" else f"{kind.meaning} of {whose}"
    )
    if condition_spec.kind == "after":
        subject = f"the time since {condition_spec.event} ended"
    if condition_spec.kind == "began":
        subject = f"the time since {condition_spec.event} began"
    if condition_spec.kind == "contact":
        return f"{whose} has touched {condition_spec.to}"
    if condition_spec.to is not None:
        subject = f"the {condition_spec.kind} ({kind.meaning}) from {whose} to {condition_spec.to}"
    return f"{subject} is {kind.rule} {in_words(condition_spec.value, kind.unit)}"


def _place(roads: RoadsSpec, at: Waypoint) -> str:
    lane = f"lane {at.lane}" if isinstance(at.lane, int) else f"the {at.lane}"
    where = f" of leg {at.leg} {at.way}"
    if roads.template == "road":
        where = "" if at.way == "out" else " of the oncoming side"
    aside = "" if at.offset == 0.0 else f", {beside(at.offset)} of its centre"
    return f"{in_words(at.distance, 'm')} on {lane}{where}{aside}"


def write_scenario_page(path: Path, scenario: LogicalScenario, name: str) -> None:
    """Write the page of a scenario, whole or not at all.

    Args:
        path: of the page.
        scenario: it.
        name: by which commands know it: of the catalogue, or the path of its file.

    Raises:
        StorageError: the file cannot be written.
    """
    pipeline, aim = Pipeline(scenario, scenario.space()), scenario.objective
    templates.write_page(
        path,
        "pages/web/scenario.html",
        title=f"{scenario.name}: {scenario.title}",
        generator=GENERATOR,
        scenario=scenario,
        facts=[
            scenario.name,
            f"template {scenario.roads.template}",
            *(["traffic on the left"] if scenario.roads.left_hand else []),
            f"ego {pipeline.driver.name}",
            f"{scenario.duration:g} s",
            f"searched: {', '.join(scenario.axes)}",
            f"critical: {critical_in_words(aim.rule, aim.count, aim.critical, aim.criteria)}",
        ],
        picture=Markup(sketch(pipeline.runner)),
        story=[*story_lines(scenario)],
        parameters=[_parameter(parameter) for parameter in scenario.parameters.values()],
        rules=(*scenario.bounds, *scenario.derived),
        **_trial(scenario, name),
    )


def _trial(scenario: LogicalScenario, name: str) -> dict[str, object]:
    """Return the player with its sliders for the template, or why there is none."""
    if scenario.objective.gated:  # as a search has it, see ``scenarios.as_judged``
        scenario = replace(scenario, road_end="leave")
    pipeline = Pipeline(scenario, scenario.space())
    words = ["bridgegen", "simulate", name]
    driven = [*words, "--ego", pipeline.driver.name]  # a logical scenario always has one
    simulation = simulation_payload(pipeline, (shlex.join(driven), shlex.join(words)))
    none: dict[str, object] = {"data": "", "script": "", "player_css": ""}
    if "refused" in simulation:
        return none | {"refused": simulation["refused"]}
    try:
        playback = nominal_playback(pipeline, scenario.name)
    except InputError as error:
        return none | {"refused": str(error)}
    aim = scenario.objective
    data = {
        "live": False,
        "confirmations": [],
        "summary": {
            "critical_distance": None,
            "hard_braking": HARD_BRAKING,
            "harm": "harm_any" if aim.count == "any" else "harm",
            "critical_rule": critical_in_words(aim.rule, aim.count, aim.critical, aim.criteria),
        },
        "rows": {
            "columns": [
                {"name": parameter.name, "unit": parameter.unit}
                | {"description": parameter.description, **parameter.kind.labels()}
                for parameter in scenario.parameters.values()
            ],
            "telling": [],
            "evaluation": [],
        },
        "scale": {**SCALE, "road": ROAD_SCALE},
        "roads": [road_payload(playback)],
        "kept": [playback_payload(playback, 0, None)],
        "simulation": simulation,
    }
    script, css = scripted("trial.js")
    return {"data": Markup(script_json(data)), "script": script, "player_css": css}


def _parameter(parameter: Parameter) -> list[object]:
    unit = "" if parameter.unit in ("1", "count") else f" {parameter.unit}"
    return [
        parameter.name,
        parameter.axis,
        parameter.kind.span_text(parameter.low, parameter.high, "{:g}".format, unit),
        f"{parameter.kind.text(parameter.default, '{:g}'.format)}{unit}",
        (parameter.description, parameter.source),
    ]


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
    write_scenario_page(out, scenario, name_or_path)
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
    individuals = mirrored(load(owl))
    scenario = scenario_of(individuals)
    violations = check(individuals, scenario)
    picture = paint(individuals, violations, constraints_in_words(scenario))
    title = f"{owl.name}: {picture.name}" if picture.name else owl.name
    write_page(out, "show.js", title, script_json(pictures_payload([picture])))
    return out, len(violations)
