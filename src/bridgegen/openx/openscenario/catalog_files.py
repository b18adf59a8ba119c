"""Catalogues: where they lie, and how a scenario refers to an entry."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import PARAMETER, Element, OrInFiles, Tag
from bridgegen.openx.openscenario.values import AnyValue, LiteralString, String


@dataclass(frozen=True)
class Directory(Element):
    """A folder by its path, relative to the file that names it."""

    path: String


@dataclass(frozen=True)
class CatalogLocation(Element):
    """The folder of the catalogues of one kind."""

    directory: Directory


@dataclass(frozen=True)
class CatalogLocations(Element):
    """The folders of all catalogues."""

    vehicles: Annotated[CatalogLocation | None, Tag("VehicleCatalog")] = None
    controllers: Annotated[CatalogLocation | None, Tag("ControllerCatalog")] = None
    pedestrians: Annotated[CatalogLocation | None, Tag("PedestrianCatalog")] = None
    misc_objects: Annotated[CatalogLocation | None, Tag("MiscObjectCatalog")] = None
    environments: Annotated[CatalogLocation | None, Tag("EnvironmentCatalog")] = None
    maneuvers: Annotated[CatalogLocation | None, Tag("ManeuverCatalog")] = None
    trajectories: Annotated[CatalogLocation | None, Tag("TrajectoryCatalog")] = None
    routes: Annotated[CatalogLocation | None, Tag("RouteCatalog")] = None


@dataclass(frozen=True)
class ParameterAssignment(Element):
    """The value that a catalogue's entry gets for one of its parameters."""

    parameter_ref: Annotated[LiteralString, PARAMETER]
    value: AnyValue


@dataclass(frozen=True)
class ParameterAssignments(Element):
    """The values that a catalogue's entry gets for its parameters."""

    assignments: tuple[ParameterAssignment, ...] = ()


@dataclass(frozen=True)
class CatalogReference(Element):
    """An entry of a catalogue, in place of what it is.

    `bridgegen.openx.openscenario.read` puts the entry there: who has a scenario from it meets none.
    """

    catalog_name: String
    entry_name: String
    parameter_assignments: ParameterAssignments | None = None


CATALOG = OrInFiles(CatalogReference)
"""Marks a child for which a file may name a catalogue's entry."""
