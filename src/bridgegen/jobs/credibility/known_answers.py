"""Cases with known answers: closed forms, published numbers, and laws that hold of any scene.

Those of ``known-answers.yaml`` are data; the others, which need more than a scene, are here.
Answers come from formulas in plain arithmetic, or are published; no kernel computes its own.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib import import_module
from importlib.resources import files
from itertools import product
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import yaml

from bridgegen.assess.conflict import analysis
from bridgegen.assess.conflict.harm import harm_of_pairs
from bridgegen.assess.metrics import METRICS, evaluate
from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRIP
from bridgegen.drivers import (
    _attentive_kernels,
    _lights_kernels,
    _path_kernels,
    _speed_kernels,
    _tracking_kernels,
    _weather_columns,
    _weather_kernels,
    kinds,
)
from bridgegen.drivers.preventable import avoids_cut_in
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import _motion_kernels as motion
from bridgegen.simulation.rollout import Rollout

Kind = Literal["answer", "law", "bits"]
"""How a case knows: a closed form or published number; a law of any scene; the published bits."""

DT = 0.05
BOXES = ((5.0, 2.0, 0.0), (4.0, 1.8, 0.0))
NAMES = {
    **{name: float(getattr(analysis, name)) for name in ("COURSE", "CONTACT")},
    **{name: float(getattr(kinds, name)) for name in ("CAR", "TRUCK", "MOTORCYCLE", "BICYCLE")},
    "PEDESTRIAN": float(kinds.PEDESTRIAN),
    **{one.name: float(one) for one in (*analysis.ConflictType, *analysis.Responsible)},
}
"""What formulas of the data may name."""

HERE = Path(str(files("bridgegen.jobs.credibility")))


class Check(NamedTuple):
    """A number that is known, and what was found; they agree up to a tolerance, NaN never."""

    name: str
    expected: Any
    found: Any
    tolerance: float = 1e-9

    @property
    def passed(self) -> bool:
        """Whether the two agree."""
        if self.expected == self.found:
            return True
        texts = isinstance(self.expected, str) or isinstance(self.found, str)
        return not texts and bool(abs(self.expected - self.found) <= self.tolerance)


@dataclass(frozen=True)
class Case:
    """A case: its feature is a key of ``features`` in the data; ``checks`` yields its numbers."""

    id: str
    feature: str
    kind: Kind
    what: str
    checks: Callable[[], Iterator[Check]]


@cache
def data() -> dict[str, Any]:
    """Return ``known-answers.yaml``."""
    found: dict[str, Any] = yaml.safe_load((HERE / "known-answers.yaml").read_text("utf-8"))
    return found


def cases() -> list[Case]:
    """Return all cases but those of bits, by their ids."""
    found = [
        Case(one["id"], one["feature"], "answer", one["what"], partial(_of_data, one["checks"]))
        for one in data()["cases"]
    ]
    return sorted([*found, *_OURS], key=lambda case: ("MCSDEL".index(case.id[0]), case.id))


# --- Cases that are data ---


def _value(given: Any, names: Mapping[str, float]) -> float:
    if given == "inf" or not isinstance(given, str):
        return float(given)
    return float(parse(given).evaluate(names))


def _of_data(checks: list[dict[str, Any]]) -> Iterator[Check]:
    for check in checks:
        loops = check.get("for", {})
        for values in product(*loops.values()):
            names = NAMES | dict(zip(loops, map(float, values), strict=True))
            for name, text in check.get("let", {}).items():
                names[name] = _value(text, names)
            expected = _value(check["expected"], names)
            found = _called(check, names) if "call" in check else _seen(check, names)
            title = check["name"].format(**names)
            yield Check(title, expected, found, check.get("tolerance", 1e-9))


def _called(check: dict[str, Any], names: Mapping[str, float]) -> float:
    module, _, name = check["call"].partition(":")
    args = [one if isinstance(one, int) else _value(one, names) for one in check["args"]]
    args = [int(one) if given in NAMES else one
            for one, given in zip(args, check["args"], strict=True)]  # fmt: skip
    found = getattr(import_module(f"bridgegen.{module}"), name)(*args)
    return float(found[check["item"]] if "item" in check else found)


def _seen(check: dict[str, Any], names: Mapping[str, float]) -> float:
    bodies = [
        {key: _value(one, names) for key, one in body.items()} | {"t": check.get("t", 0.0)}
        for body in check["bodies"]
    ]
    more: dict[str, Any] = {"kinds": [int(names[one]) for one in check.get("kinds", ())]}
    if "friction" in check:
        more["friction"] = np.array([_value(check["friction"], names)])
    scene = _scene(*(_body(**body) for body in bodies), **more)
    if "metric" in check:
        return float(evaluate(scene, [check["metric"]])[0, 0])
    return float(getattr(analysis.analyse(scene), check["verdict"])[0, 1])


def _body(
    x: float = 0.0, y: float = 0.0, h: float = 0.0, v: float = 0.0, a: float = 0.0, t: float = 0.0
) -> dict[str, Float]:
    """Return a track over t seconds: straight on, with an acceleration until it stands."""
    v_of = np.maximum(v + a * DT * np.arange(round(t / DT) + 1), 0.0)
    gone = np.concatenate([[0.0], np.cumsum(0.5 * DT * (v_of[1:] + v_of[:-1]))])
    fixed = {"h": np.full_like(gone, h), "v": v_of, "a": np.where(v_of > 0.0, a, 0.0)}
    return {"x": x + gone * math.cos(h), "y": y + gone * math.sin(h), **fixed}


def _scene(*bodies: Mapping[str, Float], kinds: Any = (), **more: Any) -> Rollout:
    e, t = len(bodies), len(bodies[0]["x"])
    more |= {name: np.array([[one[name] for one in bodies]]) for name in bodies[0]}
    return Rollout(
        time_step=DT, names=("ego", "other")[:e], box=np.array(BOXES[:e]),
        offset=np.zeros((1, e, t)), n_steps=np.array([t]), status=np.zeros(1, np.int8),
        kinds=np.array(kinds or [0] * e), **more,
    )  # fmt: skip


# --- Cases that are not ---

_OURS: list[Case] = []


def _case(name: str, feature: str, what: str, kind: Kind = "answer") -> Callable[[Any], Any]:
    def add(checks: Callable[[], Iterator[Check]]) -> Callable[[], Iterator[Check]]:
        _OURS.append(Case(name, feature, kind, what, checks))
        return checks

    return add


@_case("M6", "metrics", "Counts at their limits: contacts 5 s apart are one, 4.9 m/s² is hard "
       "braking, a light counts if it is red before the step over its line.")  # fmt: skip
def _counts() -> Iterator[Check]:
    still = _body(t=10.0)
    for steps, expected in ((100, 1), (101, 2)):
        away = np.full(201, 20.0)
        away[[10, 10 + steps]] = 4.0
        found = evaluate(_scene(still, still | {"x": away}), ["n_collision"])[0, 0]
        yield Check(f"contacts {steps * DT:g} s apart", expected, found)
    for hard, expected in ((4.9, 1), (4.89, 0)):
        braking = _body(v=20.0, t=2.0)
        braking["a"][10:20] = -hard
        found = evaluate(_scene(braking), ["n_brake", "a_change"])[0]
        yield Check(f"brakings by {hard:g} m/s²", expected, found[0])
        yield Check("change of acceleration [m/s²]", hard, found[1])
    # Its front, 2.5 m ahead, passes a line at 12.6 m between the instants 20 and 21.
    for first, expected in ((20, 1), (21, 0)):
        lights = np.where(np.arange(41) < first, 4, 1).astype(np.int8)[None, None]
        scene = _scene(
            _body(v=10.0, t=2.0), light_names=("L",), lights=lights, stop_lights=np.array([0]),
            stop_lines=np.array([[[12.6, 0.0, 0.0]]]), stop_entities=np.array([0]),
        )  # fmt: skip
        yield Check(f"red from instant {first} on", expected, evaluate(scene, ["r_red"])[0, 0])


@_case("C4", "verdicts", "The ego fails where it is responsible, alone or with the other, or its "
       "front meets what it could have avoided.")  # fmt: skip
def _failures() -> Iterator[Check]:
    crossing = _scene(_body(-40.0, v=10.0, t=6.0), _body(0.0, -40.0, math.pi / 2, 10.0, t=6.0))
    found = analysis.analyse(crossing)
    for who, front, could in product(analysis.Responsible, (False, True), (False, True)):
        changed = replace(
            found, responsible=np.full_like(found.responsible, who),
            leads_ego=np.full_like(found.leads_ego, front),
            preventable=np.full_like(found.preventable, could),
        )  # fmt: skip
        expected = who.name in ("EGO", "SHARED") or (front and could)
        name = f"{who.name}, front {front}, avoidable {could}"
        yield Check(name, expected, bool(changed.at_fault[0, 1]))


@_case("D1", "simulation", "The vehicle: v²/(2a) within brakes and friction, its throttle's limit, "
       "a circle that closes, and the friction circle v²κ ≤ μg.")  # fmt: skip
def _vehicle() -> Iterator[Check]:
    limits = np.array([50.0, 4.0, 9.0, 0.2])  # speed, acceleration, deceleration, curvature

    def drive(v: float, demanded: float, bend: float, grip: float, n: int) -> Float:
        states = [(0.0, 0.0, 0.0, v, 0.0)]
        for _ in range(n):
            states.append(
                motion.bicycle(*states[-1][:4], demanded, bend, limits, grip, 0.0, 0.0, DT)
            )
        return np.array(states)

    for demanded, grip, a in ((-3.0, 99.0, 3.0), (-20.0, 99.0, 9.0), (-9.0, 2.0, 2.0)):
        way = drive(18.0, demanded, 0.0, grip, 300)[-1, 0]
        name = f"{-demanded:g} m/s² asked for on {grip:g} m/s² of grip [m]"
        yield Check(name, 18.0**2 / (2.0 * a), way, 0.5 * a * DT**2)
    yield Check("2 s at full throttle [m]", 20.0 + 8.0, drive(10.0, 20.0, 0.0, 99.0, 40)[-1, 0])
    circle = drive(10.0, 0.0, math.pi / 50.0, 99.0, 200)
    yield Check("a circle closes [m]", 0.0, math.hypot(*circle[-1, :2]))
    yield Check("its radius [m]", 50.0 / math.pi, 0.5 * np.ptp(circle[:, 1]), 0.01)
    turned = drive(20.0, 0.0, 0.05, 4.0, 1)[-1, 2]
    yield Check("20 m/s² asked for across, on 4 [m/s²]", 4.0, 20.0 * turned / DT)


def _driven(name: str | Path, driver: str) -> Pipeline:
    scenario = load(name)
    options = PipelineOptions(ego=driver)
    return Pipeline(scenario, scenario.space(), options, workers=Threads(1))


def _known_answer(driver: str, **values: float) -> Rollout:
    """Return the rollout of ``known-answer.yaml``, in which the car ahead brakes from 2 s on."""
    pipeline = _driven(HERE / "known-answer.yaml", driver)
    return pipeline.rollout(pipeline.space.row(values)[np.newaxis])


@_case("D2", "simulation", "A storyboard's car brakes at its instant by its rate: v²/(2a).")
def _storyboard() -> Iterator[Check]:
    for v, a in ((20.0, 3.0), (14.0, 2.5)):
        found = _known_answer("route-follower", speed=v, deceleration=a, lead_at=350.0)
        way = found.x[0, 1, -1] - found.x[0, 1, 0]
        yield Check(f"{v:g} m/s by {a:g} m/s² [m]", 2.0 * v + v * v / (2.0 * a), way, 1e-6)
        yield Check("last at its speed [s]", 2.0, DT * np.flatnonzero(found.v[0, 1] == v)[-1])
        yield Check("the ego keeps its lane [m]", 0.0, np.ptp(found.y[0, 0]), 1e-6)


@_case("E1", "drivers", "UN R157's models and RSS crash in as many cut-ins as in the code of the "
       "Commission's Joint Research Centre (JRC-FSM).")  # fmt: skip
def _commission() -> Iterator[Check]:
    for (ego, other), counts in {
        (20, 10): (136, 38, 30), (40, 20): (231, 85, 85), (60, 10): (438, 212, 196),
        (60, 50): (136, 38, 29), (90, 40): (261, 103, 102), (110, 70): (212, 81, 76),
        (130, 10): (419, 475, 428), (130, 100): (167, 57, 61),
    }.items():  # fmt: skip
        gaps = (np.arange(1, 60) if ego <= 60 else np.arange(1, 120, 2))[:, None]
        for driver, count in zip(("un-r157", "fsm", "rss"), counts, strict=True):
            speeds, lateral = (ego / 3.6, other / 3.6), np.arange(0.0, 1.8, 0.1)
            found = ~avoids_cut_in(*speeds, gaps, lateral, driver=driver)
            yield Check(f"{driver}, {ego} and {other} km/h", count, int(found.sum()))


@_case("E3", "drivers", "un-r157, simulated, stops as UN R157 says behind a car that brakes by "
       "7 m/s²: 0.75 s by 0.4 m/s², then by 12.65 m/s³ up to 0.774 g.")  # fmt: skip
def _regulation() -> Iterator[Check]:
    most, jerk = 0.774 * 9.81, 12.65
    for v in (14.0, 20.0):
        after, rise = v - 0.4 * 0.75, (most - 0.4) / jerk
        left = after - 0.5 * (0.4 + most) * rise
        ramp = after * rise - 0.2 * rise**2 - jerk * rise**3 / 6.0
        expected = v * 0.75 - 0.2 * 0.75**2 + ramp + left * left / (2.0 * most)
        found = _known_answer("un-r157", speed=v, deceleration=7.0, lead_at=54.6 + 1.9 * v)
        stands = int((found.v[0, 0] <= 0.0).argmax())
        way = found.x[0, 0, stands] - found.x[0, 0, 41]  # noticed an instant after 2 s
        yield Check(f"from {v:g} m/s [m]", expected, way, 0.03 * v)


@_case("E4", "drivers", "Yellow lights (ITE: 3 m/s²), 3 m/s² in bends to both sides, left of a "
       "path, grip of a wet road, reaction of traffic, a heading that passes 180°.")  # fmt: skip
def _parts() -> Iterator[Check]:
    for distance, stops in ((40.0, True), (25.0, False)):  # from 14 m/s by 2.45 and 3.92 m/s²
        line, yellow = np.array([distance]), np.array([3])
        asked, _ = _lights_kernels.stop_at_lights(line, yellow, 0.0, 0.0, 14.0, math.inf, -1)
        yield Check(f"stops for yellow {distance:g} m ahead", stops, bool(asked < 0.0))
    turn, always = np.arange(301.0) / 50.0, np.zeros(301, np.int64)
    for side in (1.0, -1.0):
        h, x, y = side * turn, 50.0 * np.sin(turn), side * 50.0 * (1.0 - np.cos(turn))
        bend = np.full(301, side / 50.0)
        circle = np.column_stack([x, y, h, np.cos(h), np.sin(h), bend])
        found = _speed_kernels.bend_speed(circle, always, 301, 1.0, 10.0, 10.0, 30.0, GRIP)
        yield Check(f"speed in a bend of {side * 50:g} m [m/s]", math.sqrt(150.0), found)
        at = np.array([-math.sin(h[20]), math.cos(h[20])]) * 2.0 + (x[20], y[20])
        _, aside = _path_kernels.project(circle, 301, 1.0, 20.0, *at)
        yield Check("2 m to its left [m]", 2.0, aside, 1e-6)
    weather = np.zeros(_weather_columns.WEATHER)
    weather[_weather_columns.FRICTION_SCALE] = 0.4
    _weather_kernels.derive(weather)
    grip = weather[_weather_columns.FRICTION]
    yield Check("grip at 0.4 of dry friction 0.85 [m/s²]", 0.4 * 0.85 * 9.81, grip)
    mind, k = np.zeros(16), 0
    while k < 100 and _attentive_kernels.react(k, DT, -8.0, mind) >= 0.0:
        k += 1
    yield Check("traffic brakes after [s]", 0.75, k * DT)
    tracks, memory = np.zeros((2, 32)), np.zeros((2, 32))
    box = 4.0, 2.0, 0, 1.0, 0.1, 0.1, _tracking_kernels.TRACKER
    for heading in (3.1, -3.1):
        _tracking_kernels.see(tracks, memory, 1, 0.0, 0.0, heading, *box)
    moved = tracks[1, _tracking_kernels.H] - 3.1
    least = 0.0 <= moved <= 2.0 * math.pi - 6.2
    yield Check("a heading turns the short way", True, bool(least))


@_case("E5", "drivers", "Elementary functions agree with the C library's.")
def _elementary() -> Iterator[Check]:
    x = np.linspace(0.01, 0.99, 99)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "expm1", "log", "log2"):
        want = np.array([getattr(math, name)(each) for each in x])
        off = np.abs(getattr(elementary, name)(x) / want - 1.0).max()
        yield Check(f"{name}, relative error", 0.0, off, 1e-14)


# --- Laws ---


def _judged(scene: Rollout) -> Float:
    """Return what is said of each row: metrics of motion; kind, type, time and harm of pairs."""
    names = [name for name, metric in METRICS.items() if metric.needs is None]
    found = analysis.encounters(scene)
    of_pairs = (found.kind, found.type, found.ttc, harm_of_pairs(found, "any"))
    pairs = [np.sort(each[:, 1:], axis=1) for each in of_pairs]
    return np.nan_to_num(np.column_stack([evaluate(scene, names), *pairs]), posinf=1e6)


@_case("L1", "invariance", "Metrics and verdicts are the same where a scene is moved and turned, "
       "or mirrored, others change places, or a row is judged alone.", "law")  # fmt: skip
def _scenes() -> Iterator[Check]:
    rng, shape, t = np.random.default_rng(7), (8, 4, 1), DT * np.arange(50)
    v = np.maximum(rng.uniform(0.0, 14.0, shape) + rng.uniform(-6.0, 3.0, shape) * t, 0.0)
    h = rng.uniform(-3.0, 3.0, shape) + rng.uniform(-0.5, 0.5, shape) * t
    x, y = (rng.uniform(-15.0, 15.0, shape) + np.cumsum(DT * v * f(h), 2) for f in (np.cos, np.sin))
    scene = Rollout(
        time_step=DT, names=("ego", "a", "b", "c"), x=x, y=y, h=h, v=v,
        a=np.gradient(v, DT, axis=2),
        box=np.column_stack([rng.uniform(3.0, 9.0, 4), rng.uniform(1.0, 3.0, 4), np.zeros(4)]),
        offset=np.zeros_like(x), n_steps=np.full(8, 50), status=np.zeros(8, np.int8),
        kinds=np.array([kinds.CAR, kinds.CAR, kinds.TRUCK, kinds.BICYCLE]),
    )  # fmt: skip
    c, s, order = math.cos(1.0), math.sin(1.0), np.array([0, 3, 1, 2])
    states = {name: getattr(scene, name) for name in ("x", "y", "h", "v", "a", "offset")}
    each = {name: array[:, order] for name, array in states.items()}
    row = {name: array[5:6] for name, array in states.items()}
    row |= {"n_steps": scene.n_steps[5:6], "status": scene.status[5:6]}
    found = _judged(scene)
    for name, changed, rows, tolerance in (
        ("moved and turned", {"x": c * x - s * y + 100.0, "y": s * x + c * y - 50.0, "h": h + 1.0},
         found, 1e-6),
        ("mirrored", {"y": -y, "h": -h}, found, 1e-6),
        ("in another order", each | {"box": scene.box[order], "kinds": scene.kinds[order]}, found,
         0.0),
        ("a row alone", row, found[5:6], 0.0),
    ):  # fmt: skip
        off = np.abs(_judged(replace(scene, **changed)) - rows).max()
        yield Check(f"{name}: largest difference", 0.0, off, tolerance)


@_case("L2", "invariance", "A row's motion depends on neither batch nor repetition; the ego moves "
       "by its speed, within what its tyres give.", "law")  # fmt: skip
def _motions() -> Iterator[Check]:
    for name, driver in (
        ("crossroads-s4", "route-follower"), ("stopped-after-curve", "careful"),
        ("cut-in", "un-r157"),
    ):  # fmt: skip
        pipeline = _driven(name, driver)
        X = pipeline.space.decode(np.random.default_rng(1).random((60, pipeline.space.n_var)))
        X = X[np.isfinite(X).all(axis=1)]
        found, again, alone = (pipeline.rollout(rows) for rows in (X, X, X[7:8]))
        same = found.x[7, :, : alone.x.shape[2]]
        yield Check(f"{name}: again", 0.0, np.abs(found.x - again.x).max(), 0.0)
        yield Check(f"{name}: a row alone", 0.0, np.abs(same - alone.x[0]).max(), 0.0)
        real = np.arange(found.x.shape[2] - 1) < found.n_steps[:, None] - 2
        v, turned = found.v[:, 0], np.diff(found.h[:, 0])
        way = np.hypot(np.diff(found.x[:, 0]), np.diff(found.y[:, 0]))
        off = np.abs(way - 0.5 * DT * (v[:, 1:] + v[:, :-1]))[real].max()
        yield Check(f"{name}: way less mean speed [m]", 0.0, off)
        across = v[:, :-1] ** 2 * turned / np.maximum(way, 1e-3)
        over = np.hypot(np.diff(v) / DT, across) - found.friction[:, None]
        most = max(over[real & (way > 0.05)].max(), 0.0)
        yield Check(f"{name}: acceleration beyond friction [m/s²]", 0.0, most, 0.3)
