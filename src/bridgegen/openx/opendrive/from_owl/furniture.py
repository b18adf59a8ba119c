"""OWL2OpenDRIVE, its layer 2: crosswalks, stop lines, lights, signs, lamps on or beside a road."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from bridgegen.openx.opendrive.furniture import (
    Control,
    Controller,
    CornerLocal,
    Object,
    Outline,
    Signal,
    Validity,
)
from bridgegen.openx.opendrive.user_data import UserData, user_datum
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

Reach = tuple[tuple[float, float], ...]
"""Extent of a road to its left and right [m]: of its driving lanes, and of all its lanes."""

SIGNS = {"StopSign": "206", "YieldSign": "205", "SpeedLimitSign": "274", "ConstructionCard": "123"}
"""Types of signs in the German catalogue (VzKat), which readers know best."""

LIGHT = "1000001"
"""The type of a traffic light with three lamps, in OpenDRIVE's own catalogue."""

LAMP = "streetLamp"
"""The type of a street light, an object."""

STOP_LINE = "stopLine"
"""The subtype of a stop line, an object of type roadMark."""

STATES = {
    "gives_green_to": "green",
    "gives_yellow_to": "yellow",
    "gives_red_yellow_to": "red_yellow",
}
"""States that a phase shows to a light that it names, by property; to other lights it shows red."""

STOP_LINE_WIDTH = 0.5
"""Width of a stop line along the road [m]; source: RMS-1, 50 cm."""

_HEIGHT = {"light": 5.0, "sign": 2.2, "lamp": 6.0}  # m, of the lower edge or the top; ours
_SLACK = 1e-6


def objects_on(
    individuals: Individuals, road: Subject, reach: Reach, length: float, problems: list[str]
) -> Iterator[Object]:
    """Yield the crosswalks, stop lines and street lights of a road."""
    left, right = reach[0][0], reach[1][0]
    for node in _on(individuals, "Crosswalk", road):
        at, width = individuals.number(node, "has_distance"), individuals.number(node, "has_width")
        what = individuals.describe(node)
        if not 0.5 * width <= at <= length - 0.5 * width:
            problems.append(
                f"has_distance [m] of {what} must keep it on its road, {0.5 * width:g} to "
                f"{length - 0.5 * width:g}, got {at:g}"
            )
            continue
        name = individuals.optional_text(node, "has_name")
        yield _area(_id(individuals, node), name, "crosswalk", at, width, -right, left)
    for node in _on(individuals, "StopLine", road):
        at = individuals.number(node, "has_distance")
        ids = [individuals.integer(n, "has_lane_id") for n in individuals.links(node, "marks_lane")]
        if not ids or not 0.0 <= at <= length:
            problems.append(
                f"{individuals.describe(node)} must mark a lane of its road (marks_lane) and lie "
                f"on it, 0 to {length:g} m, got {at:g} m and {len(ids)} lanes"
            )
            continue
        # A line lies just before the place where vehicles stop, seen from the junction.
        middle = min(at + 0.5 * STOP_LINE_WIDTH, length)
        low, high = (0.0, left) if max(ids) > 0 else (-right, 0.0)
        name = individuals.optional_text(node, "has_name")
        line = _area(
            _id(individuals, node), name, "roadMark", middle, STOP_LINE_WIDTH, low, high, STOP_LINE
        )
        yield replace(line, validity=ranges(ids), user_data=(user_datum("has_distance", at),))
    for node in _on(individuals, "StreetLight", road):
        s, t = individuals.number(node, "has_distance"), individuals.number(node, "has_t")
        _beside(individuals, node, t, reach, problems)
        if not 0.0 <= s <= length:
            problems.append(
                f"has_distance [m] of {individuals.describe(node)} must be 0 to {length:g}, its "
                f"road's length, got {s:g}"
            )
            continue
        yield Object(
            id=_id(individuals, node),
            s=s,
            t=t,
            type=LAMP,
            orientation="none",
            hdg=0.0,
            name=individuals.optional_text(node, "has_name"),
            height=_HEIGHT["lamp"],
            radius=0.1,
        )


def signals_on(
    individuals: Individuals, road: Subject, reach: Reach, junction_end: str, problems: list[str]
) -> Iterator[Signal]:
    """Yield the lights and signs beside a road."""
    for cls in ("TrafficLight", "Signage"):
        for node in _on(individuals, cls, road):
            what = individuals.describe(node)
            s, t = individuals.number(node, "has_distance"), individuals.number(node, "has_t")
            _beside(individuals, node, t, reach, problems)
            if cls == "TrafficLight" and junction_end == "none":
                problems.append(
                    f"{what} must stand at an intersection, but its road meets none: traffic "
                    "lights are at intersections only"
                )
            lanes = individuals.links(node, "governs_lane")
            ids = sorted(individuals.integer(lane, "has_lane_id") for lane in lanes)
            light = cls == "TrafficLight"
            kind = LIGHT
            if not light:
                kind = next((k for n, k in SIGNS.items() if individuals.is_a(node, n)), None) or (
                    individuals.optional_text(node, "has_signal_type") or "-1"
                )
            limit = individuals.optional_number(node, "has_speed_limit")
            yield Signal(
                id=_id(individuals, node),
                s=s,
                t=t,
                dynamic="yes" if light else "no",
                orientation="-" if ids and ids[0] > 0 else "+",
                type=kind,
                subtype="-1",
                z_offset=_HEIGHT["light" if light else "sign"],
                name=individuals.optional_text(node, "has_name"),
                country="OpenDRIVE" if light else "DE",
                value=None if limit is None else round(limit * 3.6, 6),
                unit=None if limit is None else "km/h",
                height=0.9,
                width=0.3 if light else 0.6,
                validity=ranges(ids),
                user_data=() if limit is None else (user_datum("has_speed_limit", limit),),
            )


def ranges(ids: Sequence[int]) -> tuple[Validity, ...]:
    """Return lane ids as ranges without gaps, in ascending order; 0 is no lane and no gap."""
    found: list[Validity] = []
    for number in sorted(set(ids)):
        if found and number - found[-1].to_lane == (2 if found[-1].to_lane == -1 else 1):
            found[-1] = Validity(found[-1].from_lane, number)
        else:
            found.append(Validity(number, number))
    return tuple(found)


def _beside(
    individuals: Individuals, node: Subject, t: float, reach: Reach, problems: list[str]
) -> None:
    edge = reach[0][1] if t > 0.0 else reach[1][1]
    if abs(t) < edge - _SLACK:
        problems.append(
            f"{individuals.describe(node)} must stand beside the road, has_t [m] beyond "
            f"±{edge:g}, got {t:g}"
        )


def controllers_of(individuals: Individuals) -> tuple[Controller, ...]:
    """Return the controllers of the lights: one for all that change together.

    OpenDRIVE says which lights a controller switches, not when. That is an OpenSCENARIO file's
    to say; here it is kept as ``userData``: per phase its index, what it shows to these lights,
    its duration [s] and its name.
    """
    found: list[Controller] = []
    for controller in individuals.of_class("SignalController"):
        groups: dict[tuple[tuple[int, str], ...], list[str]] = {}
        phases = individuals.links(controller, "has_phase")
        for light in individuals.links(controller, "has_light"):
            shown = sorted(
                (individuals.integer(phase, "has_index"), link)
                for phase in phases
                for link in STATES
                if light in individuals.links(phase, link)
            )
            groups.setdefault(tuple(shown), []).append(_id(individuals, light))
        for shown_to, lights in groups.items():
            number = str(len(found) + 1)
            controls = tuple(Control(name, "0") for name in sorted(lights))
            about = _program(individuals, controller, dict(shown_to))
            found.append(Controller(number, f"signals {number}", len(found), controls, about))
    return tuple(found)


def _program(
    individuals: Individuals, controller: Subject, shown: dict[int, str]
) -> tuple[UserData, ...]:
    """Return a controller of the ontology: its identity and phases."""
    data: list[UserData] = []
    for name in ("has_name", "has_object_id"):
        text = individuals.optional_text(controller, name)
        if text is not None:
            data.append(user_datum(name, text))
    offset = individuals.optional_number(controller, "has_offset")
    if offset is not None:
        data.append(user_datum("has_offset", offset))
    phases = individuals.links(controller, "has_phase")
    for phase in sorted(phases, key=lambda node: individuals.integer(node, "has_index")):
        index = individuals.integer(phase, "has_index")
        state = STATES[shown[index]] if index in shown else "red"
        duration = individuals.number(phase, "has_duration")
        name = individuals.optional_text(phase, "has_name") or ""
        data.append(user_datum("phase", f"{index} {state} {duration!r} {name}".rstrip()))
    return tuple(data)


def _on(individuals: Individuals, cls: str, road: Subject) -> Iterator[Subject]:
    for node in individuals.of_class(cls):
        if individuals.optional_link(node, "on_road") == road:
            yield node


def _id(individuals: Individuals, node: Subject) -> str:
    return individuals.text(node, "has_object_id")


def _area(
    object_id: str,
    name: str | None,
    kind: str,
    at: float,
    width: float,
    low: float,
    high: float,
    subtype: str | None = None,
) -> Object:
    """Return a rectangle across a road: ``at`` along it, from t = ``low`` to ``high`` [m].

    Its corners are in its own coordinates: CARLA and CommonRoad's converter read no others.
    """
    first, last = max(-0.5 * width, -at), 0.5 * width
    corners = ((first, low), (first, high), (last, high), (last, low), (first, low))
    outline = Outline(
        corners_local=tuple(CornerLocal(u, v, 0.0, 0.0) for u, v in corners),
    )
    return Object(
        id=object_id,
        s=at,
        t=0.0,
        type=kind,
        subtype=subtype,
        name=name,
        orientation="none",
        hdg=0.0,
        length=width,
        width=high - low,
        outline=outline,
    )
