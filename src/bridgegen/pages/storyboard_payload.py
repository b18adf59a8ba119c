"""The OpenSCENARIO file of any row of a scenario, for a page that saves the row that it shows.

It is one file with holes: rows of one storyboard differ in the values that their files declare.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from lxml import etree

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.drivers import STORYBOARD
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.runner import Runner
from bridgegen.engine.stated import with_properties, with_vehicle
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.from_owl.quantities import parsed
from bridgegen.openx.openscenario.from_owl.signals import LAWS, Law
from bridgegen.openx.openscenario.parameters import ego_of, kind_of
from bridgegen.openx.openscenario.values import Kind, format_double
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.pages.packed import deflated

MARK = re.compile("\ue000(\\d+)\ue001")
"""A hole with its number; the characters are Unicode's for private use, which XML allows."""

MOST_ROAD = 100_000
"""Maximum number of characters of the map: those of the catalogue take 1,000 to 5,000."""


@dataclass(frozen=True)
class Hole:
    """What stands where files differ: a value of a parameter, or a text that follows from it.

    Attributes:
        of: the parameter; "" of the name of the ego's driver.
        whole: whether it is written as a whole number.
        words: texts by the value.
        law: what the text follows by; none: it is the value.
    """

    of: str
    whole: bool = False
    words: tuple[str, ...] = ()
    law: Law | None = None

    def text(self, values: Mapping[str, float], driver: str) -> str:
        """Return what stands there, without XML's escapes."""
        if not self.of:
            return driver
        x = values[self.of]
        if self.law is not None:
            return self.law.text(x)
        if self.words:
            return self.words[int(x)]
        return str(int(x)) if self.whole else format_double(x)

    def to_json(self) -> dict[str, Any]:
        """Return the same for ``storyboard.js``."""
        if self.law is None:
            return {"of": self.of, "whole": self.whole, "words": self.words}
        formula = parsed(self.law.formula).as_json()
        return {"of": self.of, "formula": formula, "words": self.law.words}


def storyboard_payload(pipeline: Pipeline, X: Float) -> dict[str, Any]:
    """Return what ``storyboard.js`` makes files of; or only "refused", why it cannot.

    Args:
        pipeline: of a scenario whose rows have one storyboard and one road network.
        X: rows of which the files are made and compared.
    """
    runner = pipeline.runner
    stem = re.sub(r"[^\w-]+", "-", pipeline.scenario.name, flags=re.ASCII)
    try:
        template, road = _template(runner, X, stem)
    except InputError as error:
        return {"refused": str(error)}
    text, holes = template
    return {
        "template": deflated(text.encode()),
        "holes": [hole.to_json() for hole in holes],
        "road": road,
        "stem": stem,
        # Stages that are ideal are the run's driver's, and stand in the file.
        "drivers": not pipeline.driver.ideal,
    }


def _template(runner: Runner, X: Float, stem: str) -> tuple[tuple[str, list[Hole]], str]:
    """Return the file with its holes, and the map, of which all these rows are made."""
    rows = [runner.concrete(x, f"{stem}.xodr") for x in X]
    road = deflated(rows[0].road_data)
    if len(road) > MOST_ROAD:
        raise InputError(f"its map takes {len(road) // 1000} kB of a page")
    first = with_vehicle(rows[0].storyboard, runner.vehicle)
    holes = _holes(runner, first)
    text = to_xml(_marked(first, holes)).decode()
    parts = MARK.split(text)  # text, number, text, number, … text
    for x, concrete in zip(X, rows, strict=True):
        file = to_xml(with_vehicle(concrete.storyboard, runner.vehicle)).decode()
        values = runner.space.values(x)
        filled = parts.copy()
        filled[1::2] = [
            _escaped([*holes.values()][int(number)].text(values, runner.driver.name))
            for number in parts[1::2]
        ]
        if "".join(filled) != file or concrete.road_data != rows[0].road_data:
            raise InputError("files of its rows differ in more than the values that they declare")
    return (text, [*holes.values()]), road


def _holes(runner: Runner, storyboard: osc.OpenScenario) -> dict[str, Hole]:
    """Return the holes by the name of the declaration; "" is the driver."""
    holes = {} if runner.driver == STORYBOARD else {"": Hole("")}
    space, declared = runner.space, storyboard.parameter_declarations
    of_weather = dict(_of_weather(to_xml(storyboard)))
    for declaration in declared.parameters if declared else ():
        name = str(declaration.name)
        if name in of_weather and of_weather[name].of in space.names:
            holes[name] = of_weather[name]
        elif name in space.names:
            known = space.parameters.get(name)
            whole = kind_of(declaration.parameter_type) is not Kind.DOUBLE
            holes[name] = Hole(name, whole, known.kind.names if known else ())
    # Derived ones that only limit others are stated in the header.
    holes |= {name: Hole(name) for name in space.derived if name not in holes}
    return holes


def _of_weather(file: bytes) -> Iterator[tuple[str, Hole]]:
    """Yield the texts that follow from parameters of the weather, by name."""
    for environment in etree.fromstring(file).iter("Environment"):
        before = environment.get("name", "").removesuffix("environment")
        found = environment.iterfind("RoadCondition/Properties/Property")
        values = {part.get("name"): part.get("value", "") for part in found}
        for text, law in LAWS.items():
            if values.get(law.part, "").startswith("$"):
                yield f"{before}{text}", Hole(values[law.part][1:], law=law)


def _marked(storyboard: osc.OpenScenario, holes: Mapping[str, Hole]) -> osc.OpenScenario:
    """Return a storyboard with marks in its holes."""
    marks = {name: f"\ue000{number}\ue001" for number, name in enumerate(holes)}

    def driven(before: osc.Properties) -> osc.Properties:
        return _with(before, {DRIVER: marks[""]})

    if "" in marks:
        storyboard = with_properties(storyboard, driven, only=ego_of(storyboard))
    header, declared = storyboard.file_header, storyboard.parameter_declarations
    if header.properties:
        stated = {f"parameter.{name}.value": mark for name, mark in marks.items()}
        header = replace(header, properties=_with(header.properties, stated))
    if declared:
        parameters = (
            replace(one, value=marks[str(one.name)]) if str(one.name) in marks else one
            for one in declared.parameters
        )
        declared = replace(declared, parameters=tuple(parameters))
    return replace(storyboard, file_header=header, parameter_declarations=declared)


def _with(before: osc.Properties, values: Mapping[str, str]) -> osc.Properties:
    """Return properties of which some have other values."""
    changed = (
        replace(one, value=values[str(one.name)]) if str(one.name) in values else one
        for one in before.properties
    )
    return replace(before, properties=tuple(changed))


def _escaped(text: str) -> str:
    """Return a text as it stands in an attribute."""
    for sign, name in {"&": "amp", "<": "lt", ">": "gt", '"': "quot"}.items():
        text = text.replace(sign, f"&{name};")
    return text
