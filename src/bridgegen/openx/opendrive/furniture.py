"""What stands on and beside roads, in OpenDRIVE's terms: objects, signals and their controllers."""

# ruff: noqa: RUF009  (fields are declared through functions that call dataclasses.field)

from dataclasses import dataclass
from typing import ClassVar

from bridgegen.base import elementary
from bridgegen.openx.opendrive.declaration import attribute, child, children
from bridgegen.openx.opendrive.user_data import UserData


@dataclass(frozen=True, slots=True)
class Validity:
    """The lanes that something applies to, ``from_lane`` ≤ ``to_lane``."""

    from_lane: int = attribute("fromLane")
    to_lane: int = attribute("toLane")


@dataclass(frozen=True, slots=True)
class CornerRoad:
    """A corner of an outline, in the road's coordinates."""

    s: float = attribute("s", unit="m", low=0.0)
    t: float = attribute("t", unit="m")
    dz: float = attribute("dz", unit="m", fallback=0.0)
    height: float = attribute("height", unit="m", low=0.0, fallback=0.0)
    id: int | None = attribute("id", default=None, low=0)


@dataclass(frozen=True, slots=True)
class CornerLocal:
    """A corner of an outline, in the object's own coordinates."""

    u: float = attribute("u", unit="m")
    v: float = attribute("v", unit="m")
    z: float = attribute("z", unit="m", fallback=0.0)
    height: float = attribute("height", unit="m", low=0.0, fallback=0.0)
    id: int | None = attribute("id", default=None, low=0)


@dataclass(frozen=True, slots=True)
class Outline:
    """The outline of an object: corners in the road's coordinates or in the object's."""

    DECORATION: ClassVar[bool] = True
    id: int | None = attribute("id", default=None, low=0)
    fill_type: str | None = attribute("fillType", default=None)
    outer: bool | None = attribute("outer", default=None)
    closed: bool | None = attribute("closed", default=None)
    lane_type: str | None = attribute("laneType", default=None)
    corners_road: tuple[CornerRoad, ...] = children("cornerRoad")
    corners_local: tuple[CornerLocal, ...] = children("cornerLocal")


@dataclass(frozen=True, slots=True)
class Object:
    """Something on or beside a road: a crosswalk, a barrier, a pole."""

    DECORATION: ClassVar[bool] = True
    id: str = attribute("id")
    s: float = attribute("s", unit="m", low=0.0)
    t: float = attribute("t", unit="m")
    z_offset: float = attribute("zOffset", default=0.0, unit="m")
    type: str | None = attribute("type", default=None)
    subtype: str | None = attribute("subtype", default=None)
    name: str | None = attribute("name", default=None)
    orientation: str | None = attribute("orientation", default=None, words=("+", "-", "none"))
    hdg: float | None = attribute("hdg", default=None, unit="rad")
    pitch: float | None = attribute("pitch", default=None, unit="rad")
    roll: float | None = attribute("roll", default=None, unit="rad")
    length: float | None = attribute("length", default=None, unit="m", low=0.0)
    width: float | None = attribute("width", default=None, unit="m", low=0.0)
    height: float | None = attribute("height", default=None, unit="m", low=0.0)
    radius: float | None = attribute("radius", default=None, unit="m", low=0.0)
    valid_length: float | None = attribute("validLength", default=None, unit="m", low=0.0)
    dynamic: str | None = attribute("dynamic", default=None, words=("yes", "no"))
    outline: Outline | None = child("outline")
    outlines: tuple[Outline, ...] = children("outlines/outline")
    validity: tuple[Validity, ...] = children("validity")
    user_data: tuple[UserData, ...] = children("userData")

    @property
    def corners(self) -> list[tuple[float, float]]:
        """The s and t of its outline's corners [m], as if the road were straight there."""
        outline = self.outline or next(iter(self.outlines), None)
        if outline is None:
            return []
        cos, sin = elementary.cos(self.hdg or 0.0), elementary.sin(self.hdg or 0.0)
        return [(road.s, road.t) for road in outline.corners_road] + [
            (self.s + local.u * cos - local.v * sin, self.t + local.u * sin + local.v * cos)
            for local in outline.corners_local
        ]


@dataclass(frozen=True, slots=True)
class Dependency:
    """Another signal that a signal depends on."""

    DECORATION: ClassVar[bool] = True
    id: str = attribute("id")
    type: str | None = attribute("type", default=None)


@dataclass(frozen=True, slots=True)
class Signal:
    """A traffic light or a sign."""

    id: str = attribute("id")
    s: float = attribute("s", unit="m", low=0.0)
    t: float = attribute("t", unit="m")
    dynamic: str = attribute("dynamic", words=("yes", "no"), fallback="no")
    orientation: str = attribute("orientation", words=("+", "-", "none"), fallback="none")
    type: str = attribute("type")
    z_offset: float = attribute("zOffset", default=0.0, unit="m")
    subtype: str = attribute("subtype", default="-1")
    name: str | None = attribute("name", default=None)
    country: str | None = attribute("country", default=None)
    country_revision: str | None = attribute("countryRevision", default=None)
    value: float | None = attribute("value", default=None)
    unit: str | None = attribute("unit", default=None)
    text: str | None = attribute("text", default=None)
    height: float | None = attribute("height", default=None, unit="m", low=0.0)
    width: float | None = attribute("width", default=None, unit="m", low=0.0)
    h_offset: float | None = attribute("hOffset", default=None, unit="rad")
    pitch: float | None = attribute("pitch", default=None, unit="rad")
    roll: float | None = attribute("roll", default=None, unit="rad")
    validity: tuple[Validity, ...] = children("validity")
    dependencies: tuple[Dependency, ...] = children("dependency")
    user_data: tuple[UserData, ...] = children("userData")


@dataclass(frozen=True, slots=True)
class SignalReference:
    """A signal of another road that holds for this one too."""

    id: str = attribute("id")
    s: float = attribute("s", unit="m", low=0.0)
    t: float = attribute("t", unit="m")
    orientation: str = attribute("orientation", words=("+", "-", "none"), fallback="none")
    validity: tuple[Validity, ...] = children("validity")


@dataclass(frozen=True, slots=True)
class Control:
    """A signal that a controller switches."""

    signal_id: str = attribute("signalId")
    type: str | None = attribute("type", default=None)


@dataclass(frozen=True, slots=True)
class Controller:
    """Signals that are switched together."""

    id: str = attribute("id")
    name: str | None = attribute("name", default=None)
    sequence: int | None = attribute("sequence", default=None, low=0)
    controls: tuple[Control, ...] = children("control")
    user_data: tuple[UserData, ...] = children("userData")
