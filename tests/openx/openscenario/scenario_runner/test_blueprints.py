"""A participant's stand-in in CARLA is of its kind and the nearest of its kind in size."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.scenario_runner.blueprints import SIZES, blueprint
from bridgegen.scenario.participants import PARTICIPANTS

AXLE = osc.Axle(0.6, 0.65, 1.6, 2.8, 0.3)


def box(length, width, height):
    return osc.BoundingBox(osc.Center(1.4, 0.0, height / 2), osc.Dimensions(width, length, height))


def vehicle(category, length, width, height, role=None):
    limits, axles = osc.Performance(60.0, 5.0, 9.0), osc.Axles(AXLE, AXLE)
    return osc.Vehicle("any", category, box(length, width, height), limits, axles, role=role)


def of(body):
    return body.length, body.width, body.height


CAR, VAN, TRUCK, BUS = (osc.VehicleCategory(one) for one in ("car", "van", "truck", "bus"))
MOTORBIKE, BICYCLE = osc.VehicleCategory.MOTORBIKE, osc.VehicleCategory.BICYCLE
BODY = {name: one.body for name, one in PARTICIPANTS.items()}
KINDS = [one for one in PARTICIPANTS.values() if one.written.element == "Vehicle" and one.carla]


@pytest.mark.parametrize(
    ("category", "kind", "name"),
    [
        (CAR, "car", "vehicle.mercedes.coupe_2020"),
        (VAN, "van", "vehicle.mercedes.sprinter"),
        (TRUCK, "truck", "vehicle.carlamotors.european_hgv"),
        (BUS, "bus", "vehicle.mitsubishi.fusorosa"),
        (MOTORBIKE, "motorcycle", "vehicle.yamaha.yzf"),
        (BICYCLE, "bicycle", "vehicle.gazelle.omafiets"),
    ],
)
def test_vehicles_of_the_catalogue(category, kind, name):
    assert blueprint(vehicle(category, *of(BODY[kind]))) == name


def test_an_emergency_vehicle_looks_like_one():
    body = vehicle(VAN, *of(BODY["emergency"]), role=osc.Role.AMBULANCE)
    assert blueprint(body) == "vehicle.ford.ambulance"
    assert blueprint(vehicle(VAN, *of(BODY["van"]), role=osc.Role.CIVIL)).endswith("sprinter")


@pytest.mark.parametrize(("height", "name"), [(1.75, "0001"), (1.1, "0010"), (1.32, "0012")])
def test_pedestrians_by_their_height(height, name):
    body = osc.Pedestrian(
        "p", osc.PedestrianCategory.PEDESTRIAN, 75.0, box(0.4, 0.4, height), model3d="p"
    )
    assert blueprint(body) == f"walker.pedestrian.{name}"


@pytest.mark.parametrize(
    ("name", "category", "size", "expected"),
    [
        ("roadcone", "obstacle", of(BODY["cone"]), "static.prop.constructioncone"),
        (
            "constructioncard",
            "pole",
            of(BODY["sign"]),
            "static.prop.warningconstruction",
        ),
        ("misc", "obstacle", of(BODY["obstacle"]), "static.prop.haybale"),
        ("any", "barrier", (4.0, 0.5, 1.0), "static.prop.streetbarrier"),
        ("any", "building", (4.0, 4.0, 4.0), None),
    ],
)
def test_objects(name, category, size, expected):
    kind = osc.MiscObjectCategory(category)
    assert blueprint(osc.MiscObject(name, kind, 1.0, box(*size))) == expected


def test_what_carla_has_not():
    assert blueprint(vehicle(osc.VehicleCategory.TRAM, 30.0, 2.5, 3.5)) is None
    deer = osc.Pedestrian("deer", osc.PedestrianCategory.ANIMAL, 25.0, box(1.2, 0.4, 0.9))
    assert blueprint(deer) is None


sizes = st.tuples(*[st.floats(0.1, 30.0)] * 3)


@given(st.sampled_from(KINDS), sizes)
def test_none_of_the_kind_is_nearer(kind, size):
    role = None if kind.written.role is None else osc.Role(kind.written.role)
    found = blueprint(vehicle(osc.VehicleCategory(kind.written.category), *size, role=role))
    distances = {name: math.dist(SIZES[name], size) for name in kind.carla}
    assert distances[found] == min(distances.values())
