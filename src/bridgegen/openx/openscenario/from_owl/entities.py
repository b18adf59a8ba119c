"""OWL2OpenSCENARIO, its entities: bodies and drivers."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import EntityBody, entity_body
from bridgegen.openx.openscenario.declarations import DRIVER, IDEAL, SIREN
from bridgegen.openx.openscenario.values import format_double
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject
from bridgegen.scenario.participants import PARTICIPANTS, Body, ParticipantKind

MAX_SPEED = "max_speed"
"""Property of a pedestrian: the greatest speed [m/s]; the standard has it for vehicles."""

LIFTED = {"has_reason_to_exceed": "exceeds_limit", "has_siren": SIREN}
"""Properties of individuals of vehicles, and what they are called in files."""

_ESMINI_CONTROLLER = "ExternalController"


class Cast:
    """The participants of a scenario's individuals.

    Args:
        individuals: one scenario.
        by_name: its participants.
    """

    def __init__(self, individuals: Individuals, by_name: Mapping[str, Subject]) -> None:
        self._individuals = individuals
        self._names = {node: name for name, node in by_name.items()}

    def name(self, node: Subject, link: str) -> str:
        """Return the name of the participant that a property points to.

        Raises:
            OntologyError: it points to none, to several or to something else.
        """
        return self._name(node, link, self._individuals.link(node, link))

    def names(self, node: Subject, link: str) -> tuple[str, ...]:
        """Return the names of all participants that a property points to, in their order.

        Raises:
            OntologyError: it points to something else.
        """
        links = self._individuals.links(node, link)
        return tuple(self._name(node, link, target) for target in links)

    def _name(self, node: Subject, link: str, target: Subject) -> str:
        if target in self._names:
            return self._names[target]
        raise OntologyError(
            f"{link} of {self._individuals.describe(node)} must be a participant of the scenario, "
            f"got {self._individuals.describe(target)}"
        )


def scenario_object(individuals: Individuals, name: str, node: Subject) -> osc.ScenarioObject:
    """Return an entity.

    Raises:
        OntologyError: its individual lacks a property.
        UnsupportedError: it is of a class that has no counterpart.
    """
    controller = individuals.optional_link(node, "has_controller")
    controllers = () if controller is None else (_controller(individuals, controller),)
    return osc.ScenarioObject(name, _body(individuals, node), controllers)


def _body(individuals: Individuals, node: Subject) -> EntityBody:
    for kind in PARTICIPANTS.values():
        if individuals.is_a(node, kind.owl_class):
            return _body_of_kind(individuals, node, kind)
    known = ", ".join(kind.owl_class for kind in PARTICIPANTS.values())
    raise UnsupportedError(f"{individuals.describe(node)} must be one of {known} to be written")


def _body_of_kind(individuals: Individuals, node: Subject, kind: ParticipantKind) -> EntityBody:
    number = partial(individuals.number, node)
    body = Body(
        number("has_box_length"), number("has_box_width"), number("has_box_height"),
        number("has_center_ahead"),
    )  # fmt: skip
    mass = individuals.optional_number(node, "has_mass")
    model = individuals.optional_text(node, "has_model")
    if kind.written.element == "Vehicle":
        body = replace(
            body, wheelbase=number("has_wheelbase"), max_speed=number("has_max_speed"),
            max_acceleration=number("has_max_acceleration"),
            max_deceleration=number("has_max_deceleration"),
        )  # fmt: skip
        lifted = tuple(_lifted(individuals, node))
        return entity_body(kind, body, mass=mass, model=model, properties=lifted)
    mass = number("has_mass")
    if kind.written.element == "Pedestrian":
        fastest = individuals.optional_number(node, "has_max_speed")
        said = () if fastest is None else (osc.Property(MAX_SPEED, format_double(fastest)),)
        return entity_body(kind, body, mass=mass, model=model, properties=said)
    return entity_body(kind, body, mass=mass)


def _lifted(individuals: Individuals, node: Subject) -> Iterator[osc.Property]:
    """Yield the properties that say which rules of the traffic are not for a vehicle."""
    for key, name in LIFTED.items():
        text = individuals.optional_text(node, key)
        if text is not None:
            yield osc.Property(name, text)


def _controller(individuals: Individuals, node: Subject) -> osc.ObjectController:
    """Return a named controller; another driver replaces it or its property.

    To esmini it is an external one, which stays idle until it is activated; a type that esmini
    does not know would be an error in its log.
    """
    driver = plain_text(individuals, node, "has_driver")
    said = [osc.Property(DRIVER, driver), osc.Property("esminiController", _ESMINI_CONTROLLER)]
    if individuals.optional_text(node, "has_ideal_stages") is not None:
        said.append(osc.Property(IDEAL, plain_text(individuals, node, "has_ideal_stages")))
    properties = osc.Properties(tuple(said))
    name = plain_text(individuals, node, "has_name")
    return osc.ObjectController(osc.Controller(name, properties))


def plain_text(individuals: Individuals, node: Subject, name: str) -> str:
    """Return a text that reads as itself in the file, not as a reference to a parameter.

    Raises:
        OntologyError: it begins with ``$``.
    """
    text = individuals.text(node, name)
    if text.startswith("$"):
        raise OntologyError(
            f"{name} of {individuals.describe(node)} must not begin with $, got '{text}'"
        )
    return text
