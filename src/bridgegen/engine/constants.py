"""Constants of the models that nobody has measured for a scenario, and rows simulated with others.

One table, `CONSTANTS`, declares each with its plausible range; `NOT_VARIED` those that stay as they
are, and why. No kernel knows of it. A constant of the *motion* is a number of the compiled
storyboard, which is replaced. One of the *verdict* is frozen into the machine code of the conflict
analysis: the same functions are then run by Python, with the other value in their globals, on the
motion that was recorded. At the nominal values both give the same bits.
"""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from types import FunctionType
from typing import Any

import numpy as np

from bridgegen.assess.conflict import _limits as limits
from bridgegen.assess.conflict import analysis, severity
from bridgegen.assess.conflict.harm import Count
from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.base.physics import DRY_FRICTION
from bridgegen.drivers._weather_columns import FRICTION_SCALE, VISUAL_RANGE
from bridgegen.drivers.kinds import CAR
from bridgegen.engine.runner import Runner
from bridgegen.engine.trials import Trials
from bridgegen.openx.openscenario.values import Expr, ParameterRef, Value
from bridgegen.scenario.weather import CLEAR_AIR
from bridgegen.simulation.embedded.chassis._chassis_columns import BRAKE_LAG
from bridgegen.simulation.embedded.program import UNSAID, Program


@dataclass(frozen=True)
class Constant:
    """A constant that can be varied.

    Attributes:
        name: of it.
        words: what it is called in a sentence.
        value: the nominal one, which every other job uses.
        unit: of value and range; "×" of a factor on what a scenario's file states.
        low: the least plausible value.
        high: the greatest.
        source: of the range, with its year; "Ours" where there is none.
        influences: what follows from it.
        frozen: the name by which kernels of the conflict analysis know it; "" of the motion's.
    """

    name: str
    words: str
    value: float
    unit: str
    low: float
    high: float
    source: str
    influences: str
    frozen: str = ""


CONSTANTS = (
    Constant(
        "careful-reaction", "the careful driver's reaction time", limits.REACTION, "s", 0.7, 1.5,
        "UN R157, annex 3 (2021): 0.75 s; Green, Transportation Human Factors 2 (2000): 0.7 s if "
        "braking is expected, 1.25 s if not, 1.5 s if surprised",
        "which conflicts count as preventable, so whether the ego is at fault", "REACTION",
    ),
    Constant(
        "careful-braking", "the careful driver's deceleration", limits.BRAKING, "m/s²", 6.0, 8.34,
        "UN R157, annex 3 (2021): 0.774 g; Mattas et al., Accident Analysis & Prevention 148 "
        "(2020): 6 m/s²; the grip of a dry road, 0.85 g",
        "as its reaction time", "BRAKING",
    ),
    Constant(
        "careful-jerk", "the careful driver's build-up of braking", limits.JERK, "m/s³", 7.6, 19.0,
        "UN R157, annex 3 (2021): 0.774 g within 0.6 s; within 1.0 s and 0.4 s: ours",
        "as its reaction time", "JERK",
    ),
    Constant(
        "asked-braking", "the braking that one may ask of others", limits.COMFORT, "m/s²", 2.0, 3.5,
        "UN R79, 5.6.4.7 (2018): 3 m/s²; ISO 15622 (2018): 3.5 m/s² at speed; 2 m/s²: ours",
        "who is responsible where the other one had to brake", "COMFORT",
    ),
    Constant(
        "near-miss-ttc", "a near miss's largest time to collision", limits.SERIOUS_TTC, "s", 1.0,
        2.0,
        "van der Horst and Hogema (1993): 1.5 s; Hayward (1972): 1 s; UN R157, annex 3 (2021): 2 s",
        "what is a near miss", "SERIOUS_TTC",
    ),
    Constant(
        "near-miss-braking", "the braking that a near miss needs at least",
        limits.SERIOUS_DECELERATION, "m/s²", 3.0, 5.0,
        "Archer (2005): 3.35 m/s²; UN R79 (2018): 3 m/s²; UN R157, 5.3.1 (2021): 5 m/s²",
        "what is a near miss", "SERIOUS_DECELERATION",
    ),
    Constant(
        "close-call", "the distance of a close call", limits.CLOSE_CALL, "m", 0.25, 1.0, "Ours",
        "what is a near miss, even if braking is comfortable", "CLOSE_CALL",
    ),
    Constant(
        "contact-friction", "the friction between bodies in a collision", severity.FRICTION, "1",
        0.3, 1.0, "McHenry and McHenry, SAE 970947 (1997): 0.55, recommended range 0.3 to 1.0",
        "severity, so harm; no verdict by itself", "FRICTION",
    ),
    Constant(
        "injury-odds", "the odds of MAIS3+ at a speed", 1.0, "×", 0.5, 2.0,
        "Ours: between curves for ages and body regions in Lubbe et al. (2022) and Wang (2022)",
        "severity, so harm; no verdict by itself", "INTERCEPTS",
    ),
    Constant(
        "car-mass", "the mass of a car in a collision", float(severity.MASS[CAR]), "kg", 1100.0,
        2200.0, "ICCT, European Vehicle Market Statistics 2017/18: 1392 kg on average; range: ours",
        "severity, so harm; no verdict by itself", "MASS",
    ),
    Constant(
        "road-friction", "the friction of the dry road", DRY_FRICTION, "1", 0.8, 0.9,
        "Wong, Theory of Ground Vehicles, table 1.3 (2008): 0.8 to 0.9",
        "what tyres give, of everybody; scaled by the weather",
    ),
    Constant(
        "ego-length", "the ego's length", 1.0, "×", 0.93, 1.09,
        "Cars of 4.3 m (European Commission, JRC-FSM, 2022) to 5.0 m, of 4.6 m here",
        "contacts, gaps, clearing times",
    ),
    Constant(
        "ego-width", "the ego's width", 1.0, "×", 0.95, 1.05,
        "Ours: cars 1.8 to 2.0 m wide, of 1.9 m here", "contacts and passing",
    ),
    Constant(
        "ego-braking", "the ego's largest deceleration", 1.0, "×", 0.71, 1.1,
        "UN R13-H, annex 3 (2018): 6.43 m/s² at least, of 9 m/s² here; 1.1: ours",
        "how the ego brakes in an emergency",
    ),
    Constant(
        "others-size", "the others' size", 1.0, "×", 0.95, 1.05, "Ours",
        "contacts, gaps, what hides whom",
    ),
    Constant(
        "others-braking", "the others' largest deceleration", 1.0, "×", 0.71, 1.1,
        "as of the ego's", "others that brake as hard as they can",
    ),
    Constant(
        "brake-lag", "the lag of the ego's brakes", 1.0, "×", 0.5, 2.0,
        "Ours: 0.1 to 0.4 s, of 0.2 s of a car here", "vehicles with dynamics (--vehicle)",
    ),
    Constant(
        "clear-air", "the visual range of clear air", CLEAR_AIR, "m", 5e3, 2e4,
        "International visibility code: light haze 4 to 10 km, clear 10 to 20 km (WMO-No. 8, 2018)",
        "how far sensors see; scales what the weather states",
    ),
)  # fmt: skip
"""All constants that can be varied."""

NOT_VARIED = {
    "reaction and braking of un-r157, careful, fsm and careful-fsm": "compiled into their kernels; "
    "as egos they are under test, as fixes they find causes, not verdicts",
    "reaction and braking of attentive participants": "compiled into the kernels of the rollout",
    "sensor curves of reference (Johnson's criteria, rated range, errors)": "compiled into its "
    "kernels; clear-air varies how far they see",
    "tyres, steering and suspension": "one published parameter set, which is checked as a whole; "
    "road-friction scales its forces",
    "wheelbase": "paths lead the rear axle; a longer body reaches farther ahead (ego-length)",
    "limits of lane departures and close passes": "from traffic law; judged as compiled",
    "masses besides a car's": "by law, see docs/severity.md; they move severity only",
}
"""Constants that stay as they are, and why."""

BY_NAME: Mapping[str, Constant] = {constant.name: constant for constant in CONSTANTS}


def applying(program: Program) -> tuple[Constant, ...]:
    """Return the constants that a storyboard with its driver and vehicle depends on."""
    if program.tested.size:
        raise InputError(f"{program.place}: constants are varied where there is one ego")
    without = set()
    if not program.chassis.size:
        without.add("brake-lag")
    if not program.driver.perceives:
        without.add("clear-air")
    if len(program.names) == 1:
        without |= {"others-size", "others-braking"}
    return tuple(constant for constant in CONSTANTS if constant.name not in without)


def try_with(
    runner: Runner, X: Float, noise: Float, harm: str, count: Count, values: Mapping[str, float]
) -> Trials:
    """Simulate N rows with other constants, in this thread.

    Args:
        runner: runs them, in the embedded simulator.
        X: ``(N, len(space.names))``.
        noise: likewise, rows whose random numbers they use.
        harm: the quantity that is measured.
        count: the conflicts that count.
        values: of constants by name; the others are nominal.
    """
    factors = {
        name: value / BY_NAME[name].value
        for name, value in values.items()
        if not BY_NAME[name].frozen and value != BY_NAME[name].value
    }
    kernel = _kernel(values)
    parts: list[tuple[Int, Trials]] = []
    for at, here in runner.by_variant(X):
        if here.refused:
            parts.append((at, Trials.none(len(at))))
            continue
        there = _moved(here, X[at[:1]], factors)
        roads = there.roads_of(X[at])
        rollout = there.run(X[at], noise=here.noise_keys(noise[at]), roads=roads)
        # What follows (violations, harm, places) takes the analysis that the rollout has.
        analysis.analyse_by(rollout, kernel)
        parts.append((at, Trials.of(rollout, *roads, harm, count)))
    order = np.argsort(np.concatenate([at for at, _ in parts]))
    return Trials.join([part for _, part in parts]).take(order)


def _moved(runner: Runner, x: Float, factors: Mapping[str, float]) -> Runner:
    """Return the runner of a storyboard with some constants of the motion times a factor."""
    if not factors:
        return runner
    there = copy(runner)
    there.embedded = copy(runner.embedded)
    if runner.driver.is_own:  # its process serves them all
        there.embedded.__dict__["_own"] = runner.embedded.own_driver
    there.embedded.program = scaled(runner.embedded.program, factors)
    there.simulator = there.embedded
    if runner.has_one_network:  # it knows the bodies
        there._roads = there.embedded.roads([runner.concrete(x[0]).roads])
    return there


_LENGTH, _WIDTH, _AHEAD, _BRAKES = 0, 1, 2, 5  # columns of `Program.bodies`
_EGO, _OTHERS = slice(0, 1), slice(1, None)
_BODIES = {
    "ego-length": (_EGO, [_LENGTH, _AHEAD]),
    "ego-width": (_EGO, [_WIDTH]),
    "ego-braking": (_EGO, [_BRAKES]),
    "others-size": (_OTHERS, [_LENGTH, _WIDTH, _AHEAD]),
    "others-braking": (_OTHERS, [_BRAKES]),
}


def scaled(program: Program, factors: Mapping[str, float]) -> Program:
    """Return a program with constants of the motion times a factor, by name."""
    bodies, chassis, weathers = program.bodies.copy(), program.chassis.copy(), program.weathers
    slots = list(program.slots)
    for name, factor in factors.items():
        if name in _BODIES:
            bodies[_BODIES[name]] *= factor
        elif name == "brake-lag":
            chassis[BRAKE_LAG] *= factor
        else:
            column = FRICTION_SCALE if name == "road-friction" else VISUAL_RANGE
            clear = 1.0 if name == "road-friction" else CLEAR_AIR
            weathers = weathers.copy()
            for row in range(len(weathers)):
                # A later environment that states none leaves the start's, which is scaled.
                if weathers[row, column] != UNSAID or row == 0:
                    said = weathers[row, column]
                    slots.append(_times(clear if said == UNSAID else slots[said], factor))
                    weathers[row, column] = len(slots) - 1
    there = replace(program, bodies=bodies, chassis=chassis, weathers=weathers)
    return replace(there, slots=tuple(slots))


def _times(value: Value, factor: float) -> Value:
    """Return what a slot states, times a factor."""
    if isinstance(value, ParameterRef):
        return Expr(f"${{{value.text}*{factor!r}}}")
    if isinstance(value, Expr):
        return Expr(f"${{({value.text[2:-1]})*{factor!r}}}")
    return float(value) * factor


def _kernel(values: Mapping[str, float]) -> Callable[..., None]:
    """Return the conflict analysis with other limits; the compiled one where all are nominal."""
    from bridgegen.assess.conflict._conflict_kernels import analyse_rows

    changed = {
        name: value
        for name, value in values.items()
        if BY_NAME[name].frozen and value != BY_NAME[name].value
    }
    return analyse_rows if not changed else interpreted(analyse_rows, changed)


def interpreted(kernel: Any, values: Mapping[str, float]) -> Callable[..., None]:
    """Return a kernel of the conflict analysis as a Python function, with other constants.

    Every kernel that it calls is taken so, too: machine code has the constants frozen.
    """
    changes: list[tuple[str, Any, Any]] = []
    for constant, value in ((BY_NAME[name], value) for name, value in values.items()):
        nominal = getattr(limits if hasattr(limits, constant.frozen) else severity, constant.frozen)
        new: Any = value
        if constant.name == "injury-odds":
            new = nominal + elementary.log(value)
        elif constant.name == "car-mass":
            new = nominal.copy()
            new[CAR] = value
        changes.append((constant.frozen, nominal, new))
    made: dict[Any, Callable[..., Any]] = {}

    def of(kernel: Any) -> Callable[..., Any]:
        plain = getattr(kernel, "py_func", kernel)
        if plain not in made:
            names = dict(plain.__globals__)
            made[plain] = made_of = FunctionType(
                plain.__code__, names, plain.__name__, plain.__defaults__, plain.__closure__
            )
            for name in plain.__code__.co_names:
                there = names.get(name)
                for frozen, nominal, new in changes:
                    # By identity, too: another module may have a constant of the same name.
                    if name == frozen and there is nominal:
                        names[name] = new
                if hasattr(there, "py_func"):
                    names[name] = of(there)
            return made_of
        return made[plain]

    run = of(kernel)

    def analyse(*arguments: Any) -> None:
        with np.errstate(all="ignore"):  # as compiled: IEEE 754
            run(*arguments)

    return analyse
