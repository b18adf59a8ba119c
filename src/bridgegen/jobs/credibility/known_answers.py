"""Cases with known answers: closed forms, published numbers, and laws that hold of any scene.

Answers are computed here in plain Python from their formula, or are numbers that were published;
no kernel that is verified computes its own answer.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from bridgegen.assess.conflict import analysis
from bridgegen.assess.conflict.analysis import CONTACT, COURSE, ConflictType, Responsible, analyse
from bridgegen.assess.conflict.harm import harm_of_pairs
from bridgegen.assess.conflict.severity import FRONT, SIDE, delta_v, effective_speed, p_mais3
from bridgegen.assess.metrics import METRICS, evaluate
from bridgegen.assess.metrics.distances import Parameters
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRIP
from bridgegen.drivers import _attentive_kernels, _following_kernels, _fsm_kernels
from bridgegen.drivers import _lights_kernels, _path_kernels, _speed_kernels, _tracking_kernels
from bridgegen.drivers import _weather_columns, _weather_kernels
from bridgegen.drivers.kinds import BICYCLE, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.drivers.preventable import avoids_cut_in
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import _motion_kernels as motion
from bridgegen.simulation.embedded.motion import _lateral_kernels
from bridgegen.simulation.rollout import Rollout

Kind = Literal["answer", "law", "bits"]
"""How a case knows: a closed form or published number; a law of any scene; the published bits."""

DT, BRAKING, JERK, REACTION = 0.05, 0.774 * 9.81, 12.65, 0.75
"""[s]; and of UN R157's careful driver [m/s², m/s³, s], as the regulation states them."""


class Check(NamedTuple):
    """A number that is known, and what was found.

    Attributes:
        name: of it, with its unit.
        expected: it.
        found: what BridgeGen gives.
        tolerance: the greatest difference that passes.
    """

    name: str
    expected: float
    found: float
    tolerance: float = 1e-9

    @property
    def passed(self) -> bool:
        """Whether the two agree; NaN agrees with nothing."""
        return self.expected == self.found or abs(self.expected - self.found) <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A case of the suite.

    Attributes:
        id: "M1".
        feature: key of `bridgegen.jobs.credibility.validation.FEATURES`.
        kind: how it knows the answer.
        what: it verifies, and where the answer is from.
        checks: yields its numbers.
    """

    id: str
    feature: str
    kind: Kind
    what: str
    checks: Callable[[], Iterator[Check]]


CASES: list[Case] = []
"""All cases but those of the bits, in their order."""


def _case(name: str, feature: str, what: str, kind: Kind = "answer") -> Callable[[Any], Any]:
    def add(checks: Callable[[], Iterator[Check]]) -> Callable[[], Iterator[Check]]:
        CASES.append(Case(name, feature, kind, what, checks))
        return checks

    return add


def _body(x: Any = 0.0, y: Any = 0.0, h: Any = 0.0, v: Any = 0.0, t: float = 0.0) -> dict[str, Any]:
    """Return a body's track over t seconds: straight on at speeds that change linearly."""
    n = round(t / DT) + 1
    h, v = (np.broadcast_to(np.asarray(each, float), (n,)) for each in (h, v))
    gone = np.concatenate([[0.0], np.cumsum(0.5 * DT * (v[1:] + v[:-1]))])
    a = np.append(np.diff(v) / DT, 0.0)
    return {"x": x + gone * np.cos(h), "y": y + gone * np.sin(h), "h": h, "v": v, "a": a}


def _scene(*bodies: dict[str, Any], boxes: Any = (5.0, 2.0, 0.0), kinds: Any = None, **more: Any) -> Rollout:
    """Return one scenario of bodies, the ego first."""
    e, t = len(bodies), len(bodies[0]["x"])
    states = {name: np.array([[body[name] for body in bodies]]) for name in ("x", "y", "h", "v", "a")}
    return Rollout(
        time_step=DT, names=("ego", *(f"b{j}" for j in range(1, e))),
        box=np.broadcast_to(np.asarray(boxes, float), (e, 3)).copy(), **states,
        offset=np.zeros((1, e, t)), n_steps=np.array([t]), status=np.zeros(1, np.int8),
        kinds=np.array(kinds or [CAR] * e), **more,
    )  # fmt: skip


def _is(name: str, scene: Rollout) -> float:
    return float(evaluate(scene, [name])[0, 0])


# --- Metrics; the ego's box is 5 m by 2 m, the other's 4 m by 1.8 m ---

TWO = ((5.0, 2.0, 0.0), (4.0, 1.8, 0.0))
EAST, NORTH, WEST, SOUTH = 0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi


@_case("M1", "metrics", "distance of two boxes: ahead, across, corner to corner, turned by 45°")
def _distances() -> Iterator[Check]:
    for name, expected, other in (
        ("ahead", 20.0 - 4.5, _body(20.0)),
        ("across", 20.0 - 3.4, _body(20.0, h=NORTH)),
        ("beside", 10.0 - 1.9, _body(0.0, 10.0)),
        ("corners", math.hypot(15.5, 8.1), _body(20.0, 10.0)),
        ("turned", 20.0 - 2.5 - 2.9 / math.sqrt(2.0), _body(20.0, h=0.25 * math.pi)),
    ):
        yield Check(f"{name} [m]", expected, _is("d_min", _scene(_body(), other, boxes=TWO)))


@_case("M2", "metrics", "time to collision: following, oncoming, crossing; deceleration w²/(2d); headway")
def _times() -> Iterator[Check]:
    ego = _body(v=20.0)
    for name, expected, other in (
        ("following", 35.5 / 8.0, _body(40.0, v=12.0)),
        ("oncoming", 35.5 / 32.0, _body(40.0, h=WEST, v=12.0)),
        ("crossing", (30.0 - 0.9 - 2.5) / 20.0, _body(30.0, -12.0, h=NORTH, v=8.0)),
        ("crossing, behind the ego", math.inf, _body(30.0, -60.0, h=NORTH, v=8.0)),
    ):
        yield Check(f"{name} [s]", expected, _is("ttc", _scene(ego, other, boxes=TWO)))
    scene = _scene(ego, _body(40.0, v=12.0), boxes=TWO)
    yield Check("drac [m/s²]", 8.0**2 / (2.0 * 35.5), _is("drac", scene))
    yield Check("thw [s]", 35.5 / 20.0, _is("thw", scene))


@_case("M3", "metrics", "post-encroachment time: from when the one leaves the crossing to the other's entry")
def _encroachment() -> Iterator[Check]:
    for y, u in ((-40.0, 8.0), (-60.0, 10.0)):
        leaves, enters = (30.0 + 0.9 + 2.5) / 10.0, (-y - 1.0 - 2.0) / u
        scene = _scene(_body(-30.0, v=10.0, t=8.0), _body(0.0, y, NORTH, u, 8.0), boxes=TWO)
        steps = math.ceil(enters / DT) - math.floor(leaves / DT)
        yield Check(f"from {-y:g} m at {u:g} m/s [s]", steps * DT, _is("pet", scene))


@_case("M4", "metrics", "brake threat number: v²/(2s) before a standing car, Jansson's formula when following")
def _threats() -> Iterator[Check]:
    for name, expected, v, other in (
        ("standing", 15.0**2 / (2.0 * 35.5), 15.0, _body(40.0)),
        ("following", 8.0**2 / (2.0 * 35.5), 20.0, _body(40.0, v=12.0)),
        ("the other stops", 25.0**2 / (2.0 * (35.5 + 10.0**2 / 12.0)), 25.0, _body(40.0, v=10.0) | {"a": np.array([-6.0])}),
    ):
        found = _is("btn", _scene(_body(v=v), other, boxes=TWO))
        yield Check(f"{name} [1]", expected / (0.85 * 9.81), found)


@_case("M5", "metrics", "RSS: missing share of the safe distance, definitions 1 and 2 of Shalev-Shwartz et al. (2017)")
def _rss() -> Iterator[Check]:
    p = Parameters()

    def stops(v: float, response: float) -> float:
        after = v + response * p.accel_max
        return v * response + 0.5 * p.accel_max * response**2 + after**2 / (2.0 * p.brake_min)

    safe = stops(20.0, p.ego_response) - 12.0**2 / (2.0 * p.brake_max)
    both = stops(20.0, p.ego_response) + stops(12.0, p.other_response)
    for name, demanded, other in (("following", safe, _body(40.0, v=12.0)), ("oncoming", both, _body(40.0, h=WEST, v=12.0))):
        found = _is("rss", _scene(_body(v=20.0), other, boxes=TWO))
        yield Check(f"{name} [1]", 1.0 - 35.5 / demanded, found)
    yield Check("in the next lane [1]", 0.0, _is("rss", _scene(_body(v=20.0), _body(20.0, 3.5, v=20.0), boxes=TWO)))


@_case("M6", "metrics", "counts at their limits: contacts 5 s apart are one, 4.9 m/s² is hard braking, red when the line is passed")
def _counts() -> Iterator[Check]:
    for apart, expected in ((5.0, 1), (5.0 + DT, 2)):
        away = np.full(200, 20.0)
        away[[10, 10 + round(apart / DT)]] = 4.0
        still = {"y": np.zeros(200), "h": np.zeros(200), "v": np.zeros(200), "a": np.zeros(200)}
        scene = _scene({"x": np.zeros(200), **still}, {"x": away, **still}, boxes=TWO)
        yield Check(f"contacts {apart:g} s apart", expected, _is("n_collision", scene))
    brakes = _body(v=20.0, t=2.0)
    for hard, expected in ((4.9, 1), (4.89, 0)):
        brakes["a"] = np.where((np.arange(41) > 9) & (np.arange(41) < 20), -hard, 0.0)
        yield Check(f"brakings by {hard:g} m/s²", expected, _is("n_brake", _scene(brakes)))
        yield Check(f"change of acceleration, {hard:g} [m/s²]", hard, _is("a_change", _scene(brakes)))
    # Its front, 2.5 m ahead, passes the line at 12.6 m between the instants 20 and 21.
    for first, expected in ((20, 1), (21, 0)):
        lights = np.where(np.arange(41) < first, 4, 1).astype(np.int8)[None, None]
        scene = _scene(
            _body(v=10.0, t=2.0), light_names=("L",), lights=lights,
            stop_lines=np.array([[[12.6, 0.0, 0.0]]]), stop_lights=np.array([0]), stop_entities=np.array([0]),
        )  # fmt: skip
        yield Check(f"red since instant {first}", expected, _is("r_red", scene))


# --- Conflicts: types, responsibility and avoidability of situations with a known verdict ---


def _stopping(v: float, most: float = BRAKING) -> float:
    """Return the careful driver's stopping distance [m]: 0.75 s, then up to ``most`` by 12.65 m/s³."""
    rise = most / JERK
    left = v - 0.5 * JERK * rise**2
    return v * (REACTION + rise) - JERK * rise**3 / 6.0 + left**2 / (2.0 * most)


def _regulated(v: float) -> float:
    """Return the stopping distance of UN R157's driver [m]: 0.75 s by 0.4 m/s², then as above."""
    after, rise = v - 0.4 * REACTION, (BRAKING - 0.4) / JERK
    left = after - 0.5 * (0.4 + BRAKING) * rise
    ramp = after * rise - 0.2 * rise**2 - JERK * rise**3 / 6.0
    return v * REACTION - 0.2 * REACTION**2 + ramp + left * left / (2.0 * BRAKING)


SITUATIONS = (
    # what, ego, other, type, who is responsible; German rules of the road (StVO)
    ("crossing from the right (§ 8)", _body(-40.0, v=10.0, t=6.0), _body(0.0, -40.0, NORTH, 10.0, 6.0), ConflictType.CROSSING, Responsible.EGO),
    ("crossing from the left (§ 8)", _body(-40.0, v=10.0, t=6.0), _body(0.0, 40.0, SOUTH, 10.0, 6.0), ConflictType.CROSSING, Responsible.OTHER),
    ("runs into one that stands (§ 3)", _body(v=20.0, t=6.0), _body(100.0, t=6.0), ConflictType.REAR_END_STRIKING, Responsible.EGO),
    ("is struck from behind (§ 4)", _body(v=10.0, t=6.0), _body(-40.0, v=20.0, t=6.0), ConflictType.REAR_END_STRUCK, Responsible.OTHER),
    ("stands and is run into", _body(t=6.0), _body(-60.0, v=20.0, t=6.0), ConflictType.EGO_STANDING, Responsible.OTHER),
    ("one comes on its side of the road (§ 2)", _body(v=20.0, t=6.0), _body(104.0, 0.0, WEST, 20.0, 6.0), ConflictType.HEAD_ON, Responsible.OTHER),
)  # fmt: skip


@_case("C1", "verdicts", "type and responsibility of contacts with a legal answer")
def _situations() -> Iterator[Check]:
    for what, ego, other, kind, responsible in SITUATIONS:
        more = {"claims": np.zeros((1, 2, 2), np.int64)} if kind is ConflictType.HEAD_ON else {}
        found = analyse(_scene(ego, other, **more))
        yield Check(f"{what}: is a contact", CONTACT, found.kind[0, 1])
        yield Check(f"{what}: type", kind, found.type[0, 1])
        yield Check(f"{what}: responsible", responsible, found.responsible[0, 1])


@_case("C2", "verdicts", "UN R157's careful driver: what stands farther ahead than it stops is avoidable, dry and on 3 m/s² of grip")
def _avoidable() -> Iterator[Check]:
    for v in (8.0, 14.0, 20.0, 30.0):
        for grip in (GRIP, 3.0):
            distance = 5.0 + _stopping(v, min(BRAKING, grip))
            for spare, expected in ((0.3, True), (-0.3, False)):
                bodies = _body(v=v, t=8.0 + 2.0 * (grip < 5.0) * v / 3.0), _body(distance + spare)
                still = {name: np.full(len(bodies[0]["x"]), array[0]) for name, array in bodies[1].items()}
                found = analyse(_scene(bodies[0], still, friction=np.array([grip])))
                yield Check(f"{v:g} m/s, grip {grip:.1f}, {spare:+g} m", expected, float(found.preventable[0, 1]))


@_case("C3", "verdicts", "an ego that brakes as hard as it must has the conflict in hand, and no near miss")
def _in_hand() -> Iterator[Check]:
    for a, expected in ((6.5, COURSE), (0.0, CONTACT)):
        v = np.maximum(20.0 - a * DT * np.arange(121), 0.0)
        distance = 5.0 + 400.0 / 13.0 + 1.0
        still = {name: np.full(121, array[0]) for name, array in _body(distance).items()}
        yield Check(f"brakes by {a:g} m/s²", expected, analyse(_scene(_body(v=v, t=6.0), still)).kind[0, 1])


@_case("C4", "verdicts", "a failure is what the ego is responsible for, alone or with the other, or could have prevented with its front")
def _failures() -> Iterator[Check]:
    found = analyse(_scene(*SITUATIONS[0][1:3]))
    for who, front, could, expected in (
        (Responsible.EGO, False, False, True), (Responsible.SHARED, False, False, True),
        (Responsible.OTHER, True, True, True), (Responsible.OTHER, True, False, False),
        (Responsible.OTHER, False, True, False), (Responsible.NONE, False, False, False),
    ):  # fmt: skip
        changed = replace(
            found, responsible=np.full_like(found.responsible, who),
            leads_ego=np.full_like(found.leads_ego, front), preventable=np.full_like(found.preventable, could),
        )  # fmt: skip
        yield Check(f"{who.name}, front {front}, preventable {could}", expected, float(changed.at_fault[0, 1]))


# --- Severity ---


@_case("S1", "severity", "a plastic collision keeps momentum, friction of the surfaces is 0.55 (SAE 970947)")
def _momentum() -> Iterator[Check]:
    car, truck = (float(each) for each in delta_v(CAR, TRUCK, 10.0, 0.0))
    yield Check("car [m/s]", 10.0 * 16_000.0 / 17_500.0, car)
    yield Check("truck [m/s]", 10.0 * 1_500.0 / 17_500.0, truck)
    yield Check("friction limits [m/s]", math.hypot(10.0, 5.5), float(effective_speed(10.0, 8.0)))
    yield Check("sliding ends [m/s]", math.hypot(10.0, 3.0), float(effective_speed(10.0, 3.0)))
    scene = _scene(*SITUATIONS[5][1:3], kinds=[CAR, TRUCK])
    yield Check("head-on at 40 m/s, the car [m/s]", 40.0 * 16.0 / 17.5, float(analyse(scene).delta_v_ego[0, 1]))


@_case("S2", "severity", "curves of MAIS3+ at published points: Lubbe et al. (2022), NHTSA DOT HS 813 219, TSR 27552")
def _curves() -> Iterator[Check]:
    def logistic(power: float) -> float:
        return 1.0 / (1.0 + math.exp(-power))

    yield Check("motorcyclist, 48 km/h: 10 %", 0.1, float(p_mais3(MOTORCYCLE, 48.0 / 3.6, FRONT)), 0.003)
    yield Check("struck side, 73 km/h: 10 %", 0.1, float(p_mais3(CAR, 36.5 / 3.6, SIDE)), 1e-4)
    for name, kind, power, kmh in (
        ("pedestrian of 46 years, 50 km/h", PEDESTRIAN, -6.190 + 0.078 * 50.0 + 0.038 * 46.0, 50.0),
        ("cyclist of 39 years, 60 km/h", BICYCLE, -7.467 + 0.079 * 60.0 + 0.047 * 39.0, 60.0),
        ("frontal, 40 mile/h", CAR, -6.9774 + 0.1620 * 40.0, 40.0 * 1.609344),
    ):
        yield Check(name, logistic(power), float(p_mais3(kind, kmh / 3.6, FRONT)), 1e-9)


# --- Simulation ---

LIMITS = np.array([50.0, 4.0, 9.0, 0.2])
"""Of speed [m/s], acceleration, deceleration [m/s²] and curvature [1/m]."""


def _drive(v: float, demanded: float, bend: float, grip: float, n: int) -> Float:
    """Return the states (x, y, h, v, a) of the kinematic vehicle, ``(n + 1, 5)``."""
    states = [(0.0, 0.0, 0.0, v, 0.0)]
    for _ in range(n):
        x, y, h, v, _ = states[-1]
        states.append(motion.bicycle(x, y, h, v, demanded, bend, LIMITS, grip, 0.0, 0.0, DT))
    return np.array(states)


@_case("D1", "simulation", "braking v²/(2a), limited by brakes and friction μg; a circle closes; the friction circle v²κ ≤ μg")
def _vehicle() -> Iterator[Check]:
    for name, demanded, grip, a in (("brakes", -3.0, 99.0, 3.0), ("its brakes' limit", -20.0, 99.0, 9.0), ("ice", -9.0, 2.0, 2.0)):
        end = _drive(18.0, demanded, 0.0, grip, 300)[-1]
        yield Check(f"{name} [m]", 18.0**2 / (2.0 * a), end[0], 0.5 * a * DT**2)
    yield Check("2 s at full throttle [m]", 10.0 * 2.0 + 0.5 * 4.0 * 2.0**2, _drive(10.0, 20.0, 0.0, 99.0, 40)[-1, 0])
    circle = _drive(10.0, 0.0, 2.0 * math.pi / (10.0 * 10.0), 99.0, 200)
    yield Check("a full circle closes [m]", 0.0, math.hypot(*circle[-1, :2]))
    yield Check("its radius [m]", 50.0 / math.pi, 0.5 * np.ptp(circle[:, 1]), 0.01)
    turned = _drive(20.0, 0.0, 0.05, 4.0, 1)[-1, 2]
    yield Check("on 4 m/s² of grip, of 20 m/s² asked for: v·dh/dt [m/s²]", 4.0, 20.0 * turned / DT)


def _known_answer(driver: str, **values: float) -> Rollout:
    """Return the rollout of ``known-answer.yaml``, in which the car ahead brakes from 2 s on."""
    scenario = load(Path(str(files("bridgegen.jobs.credibility") / "known-answer.yaml")))
    space = scenario.space()
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=driver), workers=Threads(1))
    return pipeline.rollout(space.row(values)[np.newaxis])


@_case("D2", "simulation", "a storyboard's car brakes at its instant, by its rate: v²/(2a)")
def _storyboard() -> Iterator[Check]:
    for v, a in ((20.0, 3.0), (14.0, 2.5)):
        found = _known_answer("route-follower", speed=v, deceleration=a, lead_at=350.0)
        lead = found.x[0, 1] - found.x[0, 1, 0]
        yield Check(f"{v:g} m/s by {a:g} m/s²: way [m]", 2.0 * v + v * v / (2.0 * a), lead[-1], 1e-6)
        yield Check("last instant at its speed [s]", 2.0, DT * np.flatnonzero(found.v[0, 1] == v)[-1])
        yield Check("speed 2 s later [m/s]", v - 2.0 * a, found.v[0, 1, 80], 1e-9)
        yield Check("the ego keeps its lane [m]", 0.0, float(np.ptp(found.y[0, 0])), 1e-6)


@_case("D3", "simulation", "changes of lane and speed: the steepest place of a shape has the rate that is asked for")
def _shapes() -> Iterator[Check]:
    u = np.linspace(0.0, 1.0, 2001)
    for name, shape in (("cubic", motion.CUBIC), ("sinusoidal", motion.SINUSOIDAL), ("linear", motion.LINEAR)):
        share = np.array([motion.progress(shape, each)[0] for each in u])
        lasts = _lateral_kernels.lane_change_lasts(shape, motion.RATE, 1.2, 3.5)
        fastest = 3.5 * np.max(np.diff(share)) / (u[1] * lasts)
        yield Check(f"{name}: fastest across [m/s]", 1.2, fastest, 1e-5)
        yield Check(f"{name}: half way at half time", 0.5, share[1000])


# --- Drivers ---

JRC = {  # (ego, other) [km/h]: crashes of un-r157, fsm, RSS in the Commission's code
    (20, 10): (136, 38, 30), (40, 20): (231, 85, 85), (60, 10): (438, 212, 196), (60, 50): (136, 38, 29),
    (90, 40): (261, 103, 102), (110, 70): (212, 81, 76), (130, 10): (419, 475, 428), (130, 100): (167, 57, 61),
}  # fmt: skip


@_case("E1", "drivers", "UN R157's models and RSS crash in as many cut-ins as in the Commission's code (JRC-FSM)")
def _commission() -> Iterator[Check]:
    for (ego, other), counts in JRC.items():
        gaps = np.arange(1, 60) if ego <= 60 else np.arange(1, 120, 2)
        for driver, count in zip(("un-r157", "fsm", "rss"), counts, strict=True):
            found = avoids_cut_in(ego / 3.6, other / 3.6, gaps[:, None], np.arange(0.0, 1.8, 0.1), driver=driver)
            yield Check(f"{driver}, {ego} and {other} km/h", count, int((~found).sum()))


@_case("E2", "drivers", "un-r157 and fsm, simulated, brake as their texts say: UN R157, annex 3; Mattas et al. (2020)")
def _regulation() -> Iterator[Check]:
    def share(gap: float, safe: float, unsafe: float) -> float:
        return min(max((gap - safe) / (unsafe - safe), 0.0), 1.0)

    for gap, v, w in ((20.0, 20.0, 15.0), (35.0, 25.0, 20.0), (15.0, 12.0, 8.0)):
        stops = w * w / 14.0
        safe, unsafe = v * 0.75 + v * v / 8.0 - stops + 2.0, v * 0.75 + v * v / 12.0 - stops
        expected = share(gap - 2.0, safe, unsafe)
        yield Check(f"proactive measure, {gap:g} m at {v:g} and {w:g} m/s", expected, _fsm_kernels.proactive(gap, v, w))
    # Two seconds behind a car that brakes by 7 m/s² from 2 s on; noticed an instant later.
    for v in (14.0, 20.0):
        found = _known_answer("un-r157", speed=v, deceleration=7.0, lead_at=54.6 + 1.9 * v)
        stands = int((found.v[0, 0] <= 0.0).argmax())
        way = found.x[0, 0, stands] - found.x[0, 0, 41]
        yield Check(f"stopping distance of un-r157 from {v:g} m/s [m]", _regulated(v), way, 0.03 * v)


@_case("E3", "drivers", "following (Treiber et al. 2000), yellow lights (ITE), bends to both sides, paths, grip of a wet road")
def _parts() -> Iterator[Check]:
    for gap, v, w in ((30.0, 20.0, 15.0), (15.0, 10.0, 12.0)):
        desired = 2.0 + max(0.0, 1.2 * v + v * (v - w) / (2.0 * math.sqrt(1.5 * 2.0)))
        yield Check("IDM [m/s²]", 1.5 * (1.0 - (desired / gap) ** 2), _following_kernels.idm(gap, v, w))
    for distance, stops in ((40.0, True), (25.0, False)):  # from 14 m/s by 2.45 and 3.92 m/s²
        asked, _ = _lights_kernels.stop_at_lights(np.array([distance]), np.array([3]), 0.0, 0.0, 14.0, math.inf, -1)
        yield Check(f"yellow {distance:g} m ahead: stops", stops, float(asked < 0.0))
    s = np.arange(301.0)
    for side in (1.0, -1.0):
        h = side * s / 50.0
        circle = np.column_stack([50.0 * np.sin(s / 50.0), side * 50.0 * (1.0 - np.cos(s / 50.0)), h, np.cos(h), np.sin(h), np.full(301, side / 50.0)])
        found = _speed_kernels.bend_speed(circle, np.zeros(301, np.int64), 301, 1.0, 10.0, 10.0, 30.0, GRIP)
        yield Check(f"bend of {side * 50:g} m: 3 m/s² across [m/s]", math.sqrt(3.0 * 50.0), found, 1e-9)
        x, y = (50.0 - side * 2.0) * np.sin(0.4), side * (50.0 - (50.0 - side * 2.0) * np.cos(0.4))
        _, aside = _path_kernels.project(circle, 301, 1.0, 20.5, x, y)
        yield Check("2 m to the left of it [m]", 2.0, aside, 0.01)
    weather = np.zeros(_weather_columns.WEATHER)
    weather[_weather_columns.FRICTION_SCALE] = 0.4
    _weather_kernels.derive(weather)
    yield Check("grip, 0.4 of dry [m/s²]", 0.4 * 0.85 * 9.81, weather[_weather_columns.FRICTION])


@_case("E4", "drivers", "attentive traffic reacts after 0.75 s (UN R157); a tracked heading turns the short way")
def _attention() -> Iterator[Check]:
    mind, k = np.zeros(16), 0
    while _attentive_kernels.react(k, DT, -8.0, mind) >= 0.0 and k < 100:
        k += 1
    yield Check("instants until it brakes", 0.75, (k + 1) * DT, DT + 1e-9)
    tracks, memory = np.zeros((2, 32)), np.zeros((2, 32))
    for h in (3.1, -3.1):
        _tracking_kernels.see(tracks, memory, 1, 0.0, 0.0, h, 4.0, 2.0, 0, 1.0, 0.1, 0.1)
    turned = abs(tracks[1, _tracking_kernels.H] - 3.1)
    yield Check("turned by no more than 0.083 rad", 1.0, float(turned <= 2.0 * math.pi - 6.2))


# --- Laws that hold of any scene ---


def _random_scene(n: int = 8, e: int = 4, t: int = 50) -> Rollout:
    """Return scenes in which bodies turn, brake and meet in a small place."""
    rng = np.random.default_rng(7)
    time = DT * np.arange(t)
    v = np.maximum(rng.uniform(0.0, 14.0, (n, e, 1)) + rng.uniform(-6.0, 3.0, (n, e, 1)) * time, 0.0)
    h = rng.uniform(-3.0, 3.0, (n, e, 1)) + rng.uniform(-0.5, 0.5, (n, e, 1)) * time
    x, y = (rng.uniform(-15.0, 15.0, (n, e, 1)) + np.cumsum(DT * v * f(h), axis=2) for f in (np.cos, np.sin))
    return Rollout(
        time_step=DT, names=("ego", "b1", "b2", "b3"), box=np.column_stack([rng.uniform(3.0, 9.0, e), rng.uniform(1.0, 3.0, e), np.zeros(e)]),
        x=x, y=y, h=h, v=v, a=np.gradient(v, DT, axis=2), offset=np.zeros((n, e, t)), n_steps=np.full(n, t),
        status=np.zeros(n, np.int8), kinds=np.array([CAR, CAR, TRUCK, BICYCLE]),
    )  # fmt: skip


def _judged(scene: Rollout) -> Float:
    """Return what is said of each row: metrics of motion, kind, type and harm of each pair."""
    names = [name for name, metric in METRICS.items() if metric.needs is None]
    found = analysis.encounters(scene)
    pairs = (np.sort(each[:, 1:], axis=1) for each in (found.kind, found.type, found.ttc, harm_of_pairs(found, "any")))
    return np.column_stack([np.nan_to_num(evaluate(scene, names), posinf=1e6), *(np.nan_to_num(each, posinf=1e6) for each in pairs)])


@_case("L1", "invariance", "verdict and metrics are the same where a scene is moved, turned or mirrored, others change places, rows are judged alone", "law")
def _scenes() -> Iterator[Check]:
    scene = _random_scene()
    found = _judged(scene)
    c, s = math.cos(1.0), math.sin(1.0)
    turned = replace(scene, x=c * scene.x - s * scene.y + 100.0, y=s * scene.x + c * scene.y - 50.0, h=scene.h + 1.0)
    yield Check("moved and turned", 0.0, float(np.abs(_judged(turned) - found).max()), 1e-6)
    mirrored = replace(scene, y=-scene.y, h=-scene.h)
    yield Check("mirrored", 0.0, float(np.abs(_judged(mirrored) - found).max()), 1e-6)
    order = np.array([0, 3, 1, 2])
    moved = {name: getattr(scene, name)[:, order] for name in ("x", "y", "h", "v", "a", "offset")}
    swapped = replace(scene, **moved, box=scene.box[order], kinds=scene.kinds[order])
    yield Check("in another order", 0.0, float(np.abs(_judged(swapped) - found).max()), 0.0)
    rows = {name: getattr(scene, name)[5:6] for name in ("x", "y", "h", "v", "a", "offset", "n_steps", "status")}
    yield Check("a row alone", 0.0, float(np.abs(_judged(replace(scene, **rows)) - found[5:6]).max()), 0.0)


@_case("L2", "invariance", "a row's motion depends on neither batch nor repetition; bodies move by their speed, within friction and brakes", "law")
def _motions() -> Iterator[Check]:
    for name, driver in (("crossroads-s4", "route-follower"), ("stopped-after-curve", "careful"), ("cut-in", "un-r157")):
        scenario = load(name)
        space = scenario.space()
        pipeline = Pipeline(scenario, space, PipelineOptions(ego=driver), workers=Threads(1))
        X = space.decode(np.random.default_rng(1).random((60, space.n_var)))
        X = X[np.isfinite(X).all(axis=1)]
        found, again, alone = pipeline.rollout(X), pipeline.rollout(X), pipeline.rollout(X[7:8])
        last = alone.x.shape[2]
        yield Check(f"{name}: again", 0.0, float(np.abs(found.x - again.x).max()), 0.0)
        yield Check(f"{name}: a row alone", 0.0, float(np.abs(found.x[7, :, :last] - alone.x[0]).max()), 0.0)
        real = np.arange(found.x.shape[2] - 1) < found.n_steps[:, None] - 2
        v, h = found.v[:, 0], found.h[:, 0]
        way = np.hypot(np.diff(found.x[:, 0]), np.diff(found.y[:, 0]))
        mean = 0.5 * (v[:, 1:] + v[:, :-1])
        yield Check(f"{name}: way less mean speed [m]", 0.0, float(np.abs(way - mean * DT)[real].max()), 1e-9)
        force = np.hypot(np.diff(v) / DT, v[:, :-1] * v[:, :-1] * np.diff(h) / np.maximum(way, 1e-3))
        over = (force - found.friction[:, None])[real & (way > 0.05)]
        yield Check(f"{name}: acceleration beyond friction [m/s²]", 0.0, max(float(over.max()), 0.0), 0.3)
