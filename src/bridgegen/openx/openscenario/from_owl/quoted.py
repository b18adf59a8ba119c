"""OWL2OpenSCENARIO, what the ontology keeps in OpenSCENARIO's own words."""

from collections.abc import Mapping

from bridgegen.base.errors import FileFormatError, OntologyError
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.read import element_from
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject


def quoted_element(
    individuals: Individuals, node: Subject, options: Mapping[str, type[Element]]
) -> Element:
    """Return the element that an individual's has_openscenario is.

    Args:
        individuals: one scenario.
        node: of a class of what is quoted.
        options: tag → class, all that it may be.

    Raises:
        OntologyError: there is none, or it is malformed.
        UnsupportedError: it holds what cannot be run.
    """
    text = individuals.text(node, "has_openscenario")
    place = f"has_openscenario of {individuals.describe(node)}"
    try:
        return element_from(text, options, place)
    except FileFormatError as error:
        raise OntologyError(*error.problems) from None
