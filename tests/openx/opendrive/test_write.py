"""Reading gives back what was written: the same model, float for float."""

import dataclasses
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive import furniture, model, plan_view, user_data
from bridgegen.openx.opendrive.declaration import Field, plan
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import NUMBER_LIMIT, read
from bridgegen.openx.opendrive.write import to_xml

TEXT = st.text(st.characters(exclude_categories=("Cs", "Cc"), exclude_characters="￾￿"))
SMALL = st.floats(-0.05, 0.05)
SHAPES = st.one_of(
    st.just(plan_view.Line()),
    st.builds(plan_view.Arc, SMALL),
    st.builds(plan_view.Spiral, SMALL, SMALL),
    st.builds(plan_view.Poly3, SMALL, SMALL, SMALL, SMALL),
    st.builds(plan_view.ParamPoly3, SMALL, st.just(1.0), *[SMALL] * 2, SMALL, *[SMALL] * 3),
)


def value(one: Field) -> st.SearchStrategy[Any]:
    """Anything that a field may hold."""
    form = one.form
    if form.role == "choice":
        return SHAPES
    if form.role == "ids":
        return st.lists(st.integers(-9, 9), max_size=2).map(tuple)
    if form.role == "text":
        return st.none() | TEXT.map(str.strip)
    if form.role in ("child", "children"):
        below = st.deferred(lambda: record(one.types[0]))
        if form.role == "children":
            return st.lists(below, min_size=form.least, max_size=2).map(tuple)
        return below if one.required else st.none() | below
    kinds: list[st.SearchStrategy[Any]] = []
    high = NUMBER_LIMIT if form.high is None else form.high
    low = -high if form.low is None else form.low
    if float in one.types:
        above = form.above is not None
        kinds.append(st.floats(form.above if above else low, high, exclude_min=above))
    if int in one.types:
        kinds.append(st.integers(int(low), int(high)))
    if bool in one.types:
        kinds.append(st.booleans())
    if str in one.types:
        kinds.append(st.sampled_from(form.words) if form.words else TEXT)
    if one.default is None and not one.required:
        kinds.append(st.none())
    return st.one_of(kinds)


def record(cls: type) -> st.SearchStrategy[Any]:
    given_fields = {one.name: value(one) for one in plan(cls)}
    if cls is plan_view.Geometry:
        given_fields["length"] = st.just(1.0)
    if cls is model.Road:  # without links to what is not there
        given_fields |= {
            "junction": st.just("-1"),
            "predecessor": st.none(),
            "successor": st.none(),
        }
    if cls is user_data.UserData:  # of others' the reader keeps none
        given_fields["code"] = given_fields["code"].map(lambda code: user_data.PREFIX + code)
    if cls is model.LaneSection:
        return st.builds(cls, **given_fields).map(renumbered)
    if cls is model.Lane:  # borders are read as widths
        given_fields["borders"] = st.just(())
    if cls is model.Road:  # as long as its geometry, without widths beyond it
        return st.builds(cls, **given_fields).map(measured)
    return st.builds(cls, **given_fields)


def measured(road: model.Road) -> model.Road:
    """Give a road the length of its geometry, and lanes without widths."""
    last = road.plan_view[-1]
    return dataclasses.replace(
        road,
        length=min(last.s + last.length, plan_view.LENGTH_LIMIT),
        sections=tuple(
            dataclasses.replace(
                section,
                left=tuple(dataclasses.replace(lane, widths=()) for lane in section.left),
                right=tuple(dataclasses.replace(lane, widths=()) for lane in section.right),
            )
            for section in road.sections
        ),
    )


def renumbered(section: model.LaneSection) -> model.LaneSection:
    """Give the lanes the ids that their places ask for."""
    left, right = section.left, section.right
    return dataclasses.replace(
        section,
        left=tuple(dataclasses.replace(one, id=len(left) - k) for k, one in enumerate(left)),
        center=(dataclasses.replace(section.center[0], id=0),),
        right=tuple(dataclasses.replace(one, id=-1 - k) for k, one in enumerate(right)),
    )


@pytest.mark.thorough
@given(
    roads=st.lists(record(model.Road), min_size=1, max_size=2, unique_by=lambda road: road.id),
    data=st.data(),
)
@settings(max_examples=40)
def test_any_road_and_header(roads: list[model.Road], data: st.DataObject) -> None:
    header = data.draw(record(model.Header))
    controllers = tuple(data.draw(st.lists(record(furniture.Controller), max_size=2)))
    written = OpenDrive(header, tuple(roads), controllers)
    assert read(to_xml(written)) == written


@given(data=st.data())
def test_any_crossroads(
    data: st.DataObject, static: Any, crossroads: Callable[..., OpenDrive]
) -> None:
    made = crossroads(*data.draw(static).values())
    text = to_xml(made)
    assert read(text) == made
    assert to_xml(read(text)) == text


def test_crossroads_with_junction_priorities_and_controllers(
    crossroads: Callable[..., OpenDrive],
) -> None:
    made = crossroads()
    junction = dataclasses.replace(
        made.junctions[0],
        priorities=(model.Priority("101", "102"), model.Priority(low="103")),
        controllers=(model.JunctionController("7", "x", 2),),
    )
    changed = dataclasses.replace(made, junctions=(junction,))
    assert read(to_xml(changed)) == changed


def test_town05(town05: OpenDrive) -> None:
    assert len(town05.roads) == 259
    assert read(to_xml(town05)) == town05


def test_same_text_every_time(crossroads: Callable[..., OpenDrive]) -> None:
    assert to_xml(crossroads()) == to_xml(crossroads())


def test_name_that_xml_cannot_hold(crossroads: Callable[..., OpenDrive]) -> None:
    made = crossroads()
    header = dataclasses.replace(made.header, name="a\x00b")
    with refuses(InputError):
        to_xml(dataclasses.replace(made, header=header))
