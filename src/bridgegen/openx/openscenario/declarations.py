"""What a file declares: header, parameters, variables, monitors, properties, catalogues."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import (
    NAME,
    PARAMETER,
    RAW,
    TEXT,
    AtLeast,
    Element,
    OrInFiles,
    Tag,
)
from bridgegen.openx.openscenario.enumerations import ParameterType, Rule
from bridgegen.openx.openscenario.values import (
    AnyValue,
    Boolean,
    DateTime,
    LiteralString,
    String,
    UnsignedShort,
)

TIME_STEP = "time_step"
"""The header's property for the step [s] of the evaluation: the standard has no place for it."""

DEFAULT_TIME_STEP = 0.05
"""Time step where the header states none [s]."""

CAUSE = "cause"
"""The header's property for what a critical scenario's harm is put down to."""

ROAD_END, STAND = "road_end", "stand"
"""The header's property for what entities other than the ego do where their road ends: they stand
there. Without it they leave the scenario, unless a condition waits for the end of the road."""

CONFLICT_TYPE = "conflict_type"
"""The header's property for the type of a critical scenario's decisive conflict."""

RESPONSIBLE = "responsible"
"""The header's property for the responsible party: ego, other, shared or none."""

SEVERITY = "severity"
"""The header's property for the decisive conflict's severity, the probability of a MAIS3+
injury."""

KIND = "participant_kind"
"""Property of a body: its kind, where its category is only the nearest that the standard has."""

SIREN = "siren"
"""Property of a vehicle: "on" of an emergency vehicle with blue light and siren."""

ODD = "odd"
"""Property of the ego: limits of the weather in its operational design domain, see
`bridgegen.scenario.weather.read_limits`."""

DRIVER = "driver"
"""Property of a controller: the driver's name."""

IDEAL = "ideal"
"""Property of a controller: the stages of the driver that are ideal, separated by commas."""

VEHICLE = "vehicle"
"""Property of a controller: how the body moves that its driver drives, see
`bridgegen.simulation.vehicles`."""

NOISE_KEY = "noise_key"
"""Property of a controller: the key of its driver's random numbers, in decimal; where there is none
it follows from the values of the file's parameters."""


GHOST = "ghost"
"""Property of a controller, ``ghost.NAME.KEY``: what its sensors report and is not there."""

TRACKER = "tracker"
"""Property of a controller, ``tracker.KEY``: what is not resolved, and how late tracks are."""


@dataclass(frozen=True)
class Property(Element):
    """A name and a value that the standard leaves to the user."""

    name: String
    value: String


@dataclass(frozen=True)
class File(Element):
    """A file by its path, relative to the one that names it."""

    filepath: String


@dataclass(frozen=True)
class CustomContent(Element):
    """Free text."""

    text: Annotated[str, TEXT] = ""


@dataclass(frozen=True)
class Properties(Element):
    """What the standard leaves to the user."""

    properties: tuple[Property, ...] = ()
    files: tuple[File, ...] = ()
    custom_contents: tuple[CustomContent, ...] = ()

    def get(self, name: str) -> String | None:
        """Return the value of the first property of that name."""
        return next((p.value for p in self.properties if p.name == name), None)


@dataclass(frozen=True)
class License(Element):
    """The terms under which a file may be used."""

    name: String
    resource: String | None = None
    spdx_id: String | None = None
    text: Annotated[str, TEXT] = ""


@dataclass(frozen=True)
class FileHeader(Element):
    """The file's author, date, purpose, and version of the standard."""

    rev_major: UnsignedShort
    rev_minor: UnsignedShort
    date: DateTime
    description: String
    author: String
    license: License | None = None
    properties: Properties | None = None


@dataclass(frozen=True)
class ValueConstraint(Element):
    """A comparison that a parameter's value must satisfy."""

    rule: Rule
    value: Annotated[LiteralString, RAW]


@dataclass(frozen=True)
class ValueConstraintGroup(Element):
    """Constraints that must all hold."""

    constraints: Annotated[tuple[ValueConstraint, ...], AtLeast(1)]


@dataclass(frozen=True)
class ParameterDeclaration(Element):
    """A parameter with its value; of its constraint groups one must hold.

    In a file the value may refer to other parameters; in a scenario that was read it does not.
    """

    name: Annotated[LiteralString, NAME]
    parameter_type: ParameterType
    value: Annotated[LiteralString, RAW]
    constraint_groups: Annotated[tuple[ValueConstraintGroup, ...], Tag("ConstraintGroup")] = ()


@dataclass(frozen=True)
class ParameterDeclarations(Element):
    """The parameters of a scenario."""

    parameters: tuple[ParameterDeclaration, ...] = ()


@dataclass(frozen=True)
class VariableDeclaration(Element):
    """A variable, which actions set, and its first value."""

    name: Annotated[LiteralString, NAME]
    variable_type: ParameterType
    value: AnyValue


@dataclass(frozen=True)
class VariableDeclarations(Element):
    """The variables of a scenario."""

    variables: tuple[VariableDeclaration, ...] = ()


@dataclass(frozen=True)
class MonitorDeclaration(Element):
    """A monitor, which actions set, and its first value."""

    name: Annotated[LiteralString, NAME]
    value: Boolean


@dataclass(frozen=True)
class MonitorDeclarations(Element):
    """The monitors of a scenario."""

    monitors: tuple[MonitorDeclaration, ...] = ()


# --- Catalogues: where they lie, and how a scenario refers to an entry ---


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
"""Marker of a child for which a file may name a catalogue's entry."""
