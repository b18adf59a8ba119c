"""Tags of one concrete scenario in ASAM OpenLABEL 1.0, by which scenario bases find it.

The operational design domain is what `bridgegen.scenario.odd` reads of the scenario; road users and
what they do are those of its simulation. A tag that is looked for and is not there does not hold:
these are the boundary of the ontology.

Source: ASAM OpenLABEL 1.0.0, chapter 8, and openlabel_ontology_scenario_tags.ttl.
"""

import json
import uuid
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from bridgegen.drivers import kinds
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.scenario.odd.states import States
from bridgegen.simulation.rollout import Rollout

ONTOLOGY = "https://openlabel.asam.net/V1-0-0/ontologies/openlabel_ontology_scenario_tags.ttl"
SCHEMA_VERSION = "1.0.0"

_ROAD_USERS = {
    "car": ("VehicleCar",),
    "truck": ("VehicleTruck",),
    "bus": ("VehicleBus",),
    "motorcycle": ("VehicleMotorcycle", "HumanMotorcyclist"),
    "bicycle": ("VehicleCycle", "HumanCyclist"),
    "pedestrian": ("HumanPedestrian",),
    "animal": ("RoadUserAnimal",),
}
"""Terms by kind; a tram and an e-scooter have none of their own."""

_STILL = 0.1
"""Speed up to which a road user stands [m/s]."""
_NOTICED = 0.5
"""Least change of the speed that is one [m/s²]."""
_RUNS = 2.1
"""Speed from which people run [m/s]. Source: Hreljac 1993, the preferred walk-run transition."""
_TURN, _U_TURN = np.radians((45.0, 135.0))
"""Least changes of the heading that are a turn, and a U-turn."""

_SIGNALS = {
    "CommunicationSignalLeft": (kinds.HAZARD, kinds.LEFT),
    "CommunicationSignalRight": (kinds.HAZARD, kinds.RIGHT),
    "CommunicationSignalHazard": (kinds.HAZARD, kinds.HAZARD),
    "CommunicationSignalSlowing": (kinds.BRAKE, kinds.BRAKE),
    "CommunicationSignalEmergency": (kinds.BLUE, kinds.BLUE),
}
"""Of each the lamps that are looked at, and those that are lit."""


def openlabel(
    name: str,
    scenario: osc.OpenScenario,
    states: States,
    row: Mapping[str, float],
    rollout: Rollout,
) -> bytes:
    """Return the tags of a scenario as an OpenLABEL file, JSON.

    Args:
        name: of its files.
        scenario: it, without parameters.
        states: what the scenario that it is a row of states.
        row: values of parameters and derived quantities, by name.
        rollout: its simulation, N = 1.
    """
    odd = states.tags(row)
    users = {tag for tags in _ROAD_USERS.values() for tag in tags}
    present = {
        tag: None
        for kind in rollout.kinds.tolist()
        if kind >= 0
        for tag in _ROAD_USERS.get(kinds.NAMES[kind], ())
    }
    junction = states.facts & {"crossroads", "t-junction"}
    done, known = _behaviour(rollout, turns=bool(junction))
    held = {tag: value for tag, value in odd.items() if value is not False}
    lanes = dict.fromkeys(_lane_changes(scenario))
    tags: dict[str, Any] = {
        **{tag: None if value is True else _number(tag, value) for tag, value in held.items()},
        **present,
        **{tag: None if value is None else _most(value) for tag, value in done.items()},
        **lanes,
        "scenarioName": _text(name),
        "scenarioDescription": _text(scenario.file_header.description),
        "scenarioDefinition": _text(f"{name}.xosc"),
        "scenarioUniqueReference": _text(
            str(uuid.uuid5(uuid.NAMESPACE_URL, f"{name} {sorted(row.items())}"))
        ),
    }
    content = {
        "metadata": {
            "schema_version": SCHEMA_VERSION,
            "tagged_file": f"{name}.xosc",
            "annotator": f"bridgegen {version('bridgegen')}",
        },
        "ontologies": {
            "0": {
                "uri": ONTOLOGY,
                "boundary_mode": "include",
                "boundary_list": sorted({*odd, *users, *known, *lanes}),
            }
        },
        "tags": {
            str(number): {"type": tag, "ontology_uid": "0"}
            | ({} if data is None else {"tag_data": data})
            for number, (tag, data) in enumerate(tags.items())
        },
    }
    return (json.dumps({"openlabel": content}, indent=2, ensure_ascii=False) + "\n").encode()


def _text(text: object) -> dict[str, Any]:
    return {"text": [{"type": "value", "val": str(text)}]}


def _number(tag: str, value: float | None) -> dict[str, Any]:
    """Return a value; the ontology counts lanes and the ego's speed in whole numbers."""
    whole = tag in ("LaneSpecificationLaneCount", "SubjectVehicleSpeed")
    return {"num": [{"type": "value", "val": round(value or 0.0, None if whole else 6)}]}


def _most(value: float) -> dict[str, Any]:
    return {"num": [{"type": "max", "val": round(value, 6)}]}


def _behaviour(rollout: Rollout, *, turns: bool) -> tuple[dict[str, float | None], set[str]]:
    """Return the behaviour in a rollout, with rates [m/s²], and all that was looked for."""
    known = {
        "MotionDrive", "MotionReverse", "MotionStop", "MotionAccelerate", "MotionDecelerate",
        "MotionWalk", "MotionRun",
    }  # fmt: skip
    known |= {"MotionTurnLeft", "MotionTurnRight", "MotionUTurn"} if turns else set()
    known |= {*_SIGNALS} if rollout.lamps.size else set()
    found: dict[str, float | None] = {}
    n = int(rollout.n_steps[0])
    for e, kind in enumerate(rollout.kinds.tolist()):
        there = rollout.present[0, e, :n] if rollout.present.size else np.ones(n, np.bool_)
        if kind in (-1, kinds.OTHER) or not there.any():
            continue
        v, a, h = (getattr(rollout, name)[0, e, :n][there] for name in ("v", "a", "h"))
        on_foot = kinds.IS_PEDESTRIAN[kind]
        moves = "MotionWalk" if on_foot else "MotionDrive"
        fast = _RUNS if on_foot else np.inf
        found |= {moves: None} if ((v > _STILL) & (v <= fast)).any() else {}
        found |= {"MotionRun": None} if (v > fast).any() else {}
        found |= {"MotionReverse": None} if (v < -_STILL).any() else {}
        found |= {"MotionStop": None} if (np.abs(v) <= _STILL).any() else {}
        for tag, rate in (("MotionAccelerate", a.max()), ("MotionDecelerate", -a.min())):
            if rate > _NOTICED:
                found[tag] = max(float(rate), found.get(tag) or 0.0)
        change = float(h[-1] - h[0])
        if turns and not on_foot and abs(change) > _TURN:
            side = "MotionTurnLeft" if change > 0.0 else "MotionTurnRight"
            found["MotionUTurn" if abs(change) > _U_TURN else side] = None
        if rollout.lamps.size:
            lamps = rollout.lamps[0, e, :n][there]
            for tag, (mask, lit) in _SIGNALS.items():
                found |= {tag: None} if ((lamps & mask) == lit).any() else {}
    return found, known


def _lane_changes(scenario: osc.OpenScenario) -> Iterator[str]:
    """Yield the lane changes of the storyboard whose side it states."""
    for element in walk(scenario.storyboard):
        if isinstance(element, osc.LaneChangeAction):
            target = element.lane_change_target.target
            if isinstance(target, osc.RelativeTargetLane):
                yield f"MotionLaneChange{'Left' if float(str(target.value)) > 0 else 'Right'}"
