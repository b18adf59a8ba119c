"""The page that says what the simulator runs: each element of it is tried."""

import re
from pathlib import Path
from types import UnionType
from typing import Annotated, Union, get_args, get_origin, get_type_hints

import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element

from .one_of_each import examples
from .storyboards import run

PAGE = Path(__file__).parents[3] / "docs/openscenario.md"
ROWS = re.findall(r"^\| `(\w+)` \| (yes|no) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
EXAMPLES = examples()


ROOTS = (
    osc.PrivateAction, osc.GlobalAction, osc.UserDefinedAction, osc.EntityCondition,
    osc.ByValueCondition, osc.Position, osc.Shape,
)  # fmt: skip
WRAPPERS = (
    *ROOTS, osc.LongitudinalAction, osc.LateralAction, osc.RoutingAction, osc.ControllerAction,
    osc.AppearanceAction, osc.TrailerAction, osc.EntityAction, osc.InfrastructureAction,
    osc.TrafficSignalAction, osc.ParameterAction, osc.VariableAction, osc.TrafficAction,
)  # fmt: skip


def elements_in(kind: object) -> set[str]:
    """The names of the elements that are meant, inside those that only wrap them."""
    origin = get_origin(kind)
    if origin is Annotated:
        return elements_in(get_args(kind)[0])
    if origin in (Union, UnionType):
        return set().union(*map(elements_in, get_args(kind)))
    if kind not in WRAPPERS:
        is_element = isinstance(kind, type) and issubclass(kind, Element)
        return {kind.__name__} if is_element else set()
    return set().union(*map(elements_in, get_type_hints(kind, include_extras=True).values()))


@pytest.mark.parametrize(("name", "runs"), ROWS)
def test_the_simulator_does_what_the_page_says(name: str, runs: str):
    if runs == "yes":
        assert run(EXAMPLES[name]).status[0] == 0
    else:
        with refuses(UnsupportedError, "test.xosc"):
            run(EXAMPLES[name])


def test_the_page_leaves_nothing_out():
    names = {name for name, _ in ROWS}
    assert names == set(EXAMPLES)
    assert names == set().union(*map(elements_in, ROOTS))
