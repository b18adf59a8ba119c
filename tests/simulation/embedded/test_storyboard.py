"""The storyboard's states: what starts, ends, is stopped, skipped and run again, and when.

Source of the expected values: ASAM OpenSCENARIO XML 1.3.1, 8.4, worked by hand at 0.05 s.
"""

import numpy as np
import pytest

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.embedded._codes import COMPLETE, OFF, RUNNING, STANDBY
from bridgegen.simulation.embedded.compiler.declared import nodes

from .storyboards import (
    after,
    condition,
    crossroads,
    events,
    lane,
    run,
    scenario,
    simulator,
    speeding,
    start,
)

EGO = start("ego", lane(1, 1, 90.0), 0.0)
CARS = EGO + start("bv", lane(3, 1, 90.0), 5.0) + start("cv", lane(4, 1, 90.0), 5.0)


def trigger(*conditions: str, stop: bool = False) -> str:
    tag = "StopTrigger" if stop else "StartTrigger"
    return f"<{tag}><ConditionGroup>{''.join(conditions)}</ConditionGroup></{tag}>"


def event(name, action, when="", *, priority="parallel", count=1):
    return f"""<Event name="{name}" priority="{priority}" maximumExecutionCount="{count}">
<Action name="do {name}"><PrivateAction>{action}</PrivateAction></Action>{when}</Event>"""


def maneuver(*events, name="m"):
    return f'<Maneuver name="{name}">{"".join(events)}</Maneuver>'


def group(*maneuvers, name="g", count=1, actors="bv", selects="false"):
    refs = "".join(f'<EntityRef entityRef="{one}"/>' for one in actors.split())
    return f"""<ManeuverGroup name="{name}" maximumExecutionCount="{count}">
<Actors selectTriggeringEntities="{selects}">{refs}</Actors>{"".join(maneuvers)}</ManeuverGroup>"""


def act(*groups, name="a", when=None, stop=""):
    when = trigger(after(0.0)) if when is None else when
    return f'<Act name="{name}">{"".join(groups)}{when}{stop}</Act>'


def told(*acts, privates=CARS, names=("ego", "bv", "cv"), stop=()):
    text = scenario(names, privates, stop=stop)
    story = f'<Story name="s">{"".join(acts)}</Story>'
    return run(text.replace("</Init>", "</Init>" + story))


def state(kind, name, wanted, *, edge="none", delay=0.0):
    return f"""<Condition name="c" delay="{delay}" conditionEdge="{edge}"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="{kind}" storyboardElementRef="{name}"
state="{wanted}"/></ByValueCondition></Condition>"""


def began(rollout):
    instants = rollout.began[0].tolist()
    return dict(zip(rollout.event_names, instants, strict=True))


SLOWLY = speeding(7.5, "linear rate 1.25")  # from 5 m/s for two seconds; 1/16 m/s a step
AT_ONCE = speeding(6.0, "step time 0")


def marker(name, when, count=1):
    """An event of another car whose beginning says that a condition was met."""
    one = event(name, AT_ONCE, trigger(when), count=count)
    return group(maneuver(one, name="watching"), actors="cv", name=f"group of {name}")


@pytest.mark.parametrize(
    ("kind", "name", "wanted", "instant"),
    [
        # the event starts at 1 s (20), is at its speed after 2 s (60), and is then complete
        ("event", "e", "standbyState", 0),
        ("event", "e", "startTransition", 20),
        ("event", "e", "runningState", 20),
        ("event", "e", "endTransition", 60),
        ("event", "e", "completeState", 60),
        ("event", "e", "stopTransition", -1),
        ("event", "e", "skipTransition", -1),
        ("action", "do e", "runningState", 20),
        ("action", "do e", "endTransition", 60),
        ("maneuver", "m", "runningState", 0),
        ("maneuver", "m", "completeState", 60),
        ("maneuverGroup", "g", "endTransition", 60),
        ("maneuverGroup", "g", "standbyState", -1),
        ("event", "s::a::g::m::e", "completeState", 60),
        ("act", "a", "runningState", 0),
        ("act", "late", "standbyState", 0),
        ("act", "late", "startTransition", 40),
        ("story", "s", "startTransition", 0),
    ],
)
@pytest.mark.parametrize("first", [True, False])
def test_states_and_transitions(kind, name, wanted, instant, first):
    """Who looks before the element in the file sees what starts there one instant later."""
    watched = group(maneuver(event("e", SLOWLY, trigger(after(1.0)))))
    late = act(group(name="idle"), name="late", when=trigger(after(2.0)))
    watching = act(marker("seen", state(kind, name, wanted)), name="b")
    acts = (watching, act(watched), late) if first else (act(watched), late, watching)
    seen = began(told(*acts))["seen"]
    starts = wanted in ("startTransition", "runningState", "standbyState")
    assert seen == instant + (1 if first and starts and instant >= 0 and kind != "story" else 0)


def watched(*acts, privates=CARS, stop=()):
    """Return by element its phase and its executions at every instant, ``(T,)`` each."""
    text = scenario(("ego", "bv", "cv"), privates, stop=stop)
    story = f'<Story name="s">{"".join(acts)}</Story>'
    text = text.replace("</Init>", "</Init>" + story)
    made = simulator(text)
    batch = made.batch(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
    batch.start()
    phases, counts = [], []
    for k in range(batch.record.x.shape[2]):
        batch.before_driver(k)
        phases.append(batch.state.phase[0].copy())
        counts.append(batch.state.executions[0].copy())
        batch.after_driver(k, *batch.demand(k))
    found = nodes(read(text.encode(), "test.xosc").storyboard)
    names = [node.path[-1] for node in found]
    return (
        dict(zip(names, np.transpose(phases), strict=True)),
        dict(zip(names, np.transpose(counts), strict=True)),
        batch.rollout(),
    )


def changes(phase):
    """Return where a phase changes, and to what."""
    at = np.flatnonzero(np.diff(phase)) + 1
    return [(0, int(phase[0])), *((int(k), int(phase[k])) for k in at)]


def test_an_event_s_life():
    phases, counts, _ = watched(act(group(maneuver(event("e", SLOWLY, trigger(after(1.0)))))))
    assert changes(phases["e"]) == [(0, STANDBY), (20, RUNNING), (60, COMPLETE)]
    assert changes(phases["do e"]) == [(0, OFF), (20, RUNNING), (60, COMPLETE)]
    for name in ("m", "g", "a", "s"):
        assert changes(phases[name]) == [(0, RUNNING), (60, COMPLETE)]
    assert counts["e"][-1] == counts["g"][-1] == 1


def test_an_event_runs_as_often_as_it_may():
    """Each run takes 2 s; the trigger still holds, so the next one begins where one ends."""
    back_and_forth = event("e", SLOWLY, trigger(after(1.0)), count=3)
    phases, counts, rollout = watched(act(group(maneuver(back_and_forth))))
    # the second run finds its speed reached, and takes one instant
    assert changes(phases["e"])[:2] == [(0, STANDBY), (20, RUNNING)]
    assert changes(phases["e"])[-1] == (62, COMPLETE)
    assert np.flatnonzero(np.diff(counts["e"])).tolist() == [19, 59, 60]
    assert began(rollout)["e"] == 20


def test_a_rising_edge_runs_an_event_once_per_rise():
    slower = condition("bv", '<SpeedCondition value="5.5" rule="lessThan"/>')
    rises = slower.replace('conditionEdge="none"', 'conditionEdge="rising"')
    down = event("down", speeding(5.0, "step time 0"), trigger(after(4.0)))
    up = event("up", AT_ONCE, trigger(rises), count=5)
    first = event("first", AT_ONCE, trigger(after(2.0)))
    _, counts, _ = watched(act(group(maneuver(first, down, up))))
    # below 5.5 m/s from the start (no rise), above from 2 s on; below again one step after 4 s
    assert np.flatnonzero(np.diff(counts["up"])).tolist() == [80]


def test_a_maneuver_group_runs_again_while_its_act_s_trigger_holds():
    once = event("e", AT_ONCE, trigger(after(1.0)))
    phases, counts, _ = watched(act(group(maneuver(once), count=2)))
    assert counts["g"][-1] == 2
    assert counts["e"][-1] == 1  # its count begins anew with the group's run
    assert changes(phases["g"]) == [(0, RUNNING), (22, COMPLETE)]
    assert changes(phases["e"])[:2] == [(0, STANDBY), (20, RUNNING)]


def test_a_maneuver_group_whose_act_s_trigger_has_passed_waits_for_ever():
    once = event("e", AT_ONCE, trigger(after(1.0)))
    when = trigger(after(0.5, edge="rising"))
    phases, counts, _ = watched(act(group(maneuver(once), count=2), when=when))
    assert changes(phases["g"]) == [(0, OFF), (10, RUNNING), (21, STANDBY)]
    assert counts["g"][-1] == 1


@pytest.mark.parametrize(
    ("priority", "first", "second"),
    [
        ("overwrite", [(0, STANDBY), (20, RUNNING), (40, COMPLETE)], [(40, RUNNING)]),
        ("override", [(0, STANDBY), (20, RUNNING), (40, COMPLETE)], [(40, RUNNING)]),
        ("parallel", [(0, STANDBY), (20, RUNNING), (60, COMPLETE)], [(40, RUNNING)]),
        ("skip", [(0, STANDBY), (20, RUNNING), (60, COMPLETE)], [(40, COMPLETE)]),
    ],
)
def test_priorities_within_a_maneuver(priority, first, second):
    """The second event is another car's, so nothing but its priority touches the first."""
    one = event("one", SLOWLY, trigger(after(1.0)))
    when = trigger(after(2.0))
    two = event("two", AT_ONCE, when, priority=priority)
    phases, counts, _ = watched(act(group(maneuver(one, two), actors="bv")))
    if priority == "parallel":  # it takes the same car's speed, which ends the first one's action
        first = [(0, STANDBY), (20, RUNNING), (41, COMPLETE)]
    assert changes(phases["one"]) == first
    assert changes(phases["two"])[1:2] == second
    assert counts["two"][-1] == 1


def test_priorities_do_not_reach_beyond_the_maneuver():
    one = maneuver(event("one", SLOWLY, trigger(after(1.0))), name="m1")
    two = maneuver(event("two", AT_ONCE, trigger(after(2.0)), priority="override"), name="m2")
    acts = act(group(one), group(two, actors="cv", name="g2"))
    phases, _, _ = watched(acts)
    assert changes(phases["one"]) == [(0, STANDBY), (20, RUNNING), (60, COMPLETE)]


def test_a_skipped_event_may_come_again():
    """Skips count as executions: of three, 40 are not needed."""
    one = event("one", SLOWLY, trigger(after(1.0)))
    two = event("two", AT_ONCE, trigger(after(2.0)), priority="skip", count=100)
    _, counts, rollout = watched(act(group(maneuver(one, two))))
    assert began(rollout)["two"] == 60  # skipped at the 20 instants 40 to 59
    assert counts["two"][59] == 20
    assert counts["two"][60] == 21


def test_an_act_s_stop_trigger_stops_all_that_is_in_it():
    running = event("e", SLOWLY, trigger(after(1.0)))
    waiting = event("w", SLOWLY, trigger(after(5.0)))
    stop = trigger(after(2.0), stop=True)
    stopped = act(group(maneuver(running, waiting), count=7), stop=stop)
    seen = act(marker("seen", state("event", "w", "stopTransition")), name="b")
    phases, _, rollout = watched(stopped, seen)
    for name in ("a", "g", "m", "e", "do e"):
        assert changes(phases[name])[-1] == (40, COMPLETE), name
    assert changes(phases["w"]) == [(0, STANDBY), (40, COMPLETE)]
    assert changes(phases["do w"]) == [(0, OFF)]
    # the car keeps the speed that it has: 5 m/s and 1 s at 1.25 m/s²
    assert rollout.v[0, 1, 40:].tolist() == pytest.approx([6.25] * 161)
    assert began(rollout)["seen"] == 40


def test_an_act_that_is_stopped_before_it_starts_never_does():
    late = act(group(maneuver(event("e", AT_ONCE))), when=trigger(after(3.0)),
               stop=trigger(after(1.0), stop=True))  # fmt: skip
    phases, _, rollout = watched(late)
    assert changes(phases["a"]) == [(0, STANDBY), (20, COMPLETE)]
    assert began(rollout) == {"e": -1}


def test_an_event_without_a_trigger_starts_with_its_act():
    when = trigger(after(1.5))
    assert began(told(act(group(maneuver(event("e", AT_ONCE))), when=when))) == {"e": 30}
    assert began(told(act(group(maneuver(event("e", AT_ONCE))), when=""))) == {"e": 0}


def test_an_empty_trigger_never_fires():
    assert began(told(act(group(maneuver(event("e", AT_ONCE, "<StartTrigger/>")))))) == {"e": -1}


def test_a_delay_on_a_state():
    watched_ = act(group(maneuver(event("e", SLOWLY, trigger(after(1.0))))))
    seen = act(marker("seen", state("event", "e", "completeState", delay=0.5)), name="b")
    assert began(told(watched_, seen))["seen"] == 70


@pytest.mark.parametrize(
    "dynamics", ["linear rate 2", "linear time 2", "cubic time 2", "sinusoidal time 2"]
)
def test_an_action_ends_when_it_is_there_whatever_its_steps_add_up_to(dynamics):
    """From 5 to 9 m/s from 1 s on; a tenth of a metre per second is no binary number."""
    faster = event("e", speeding(9.0, dynamics), trigger(after(1.0)))
    seen = act(marker("seen", state("event", "e", "completeState")), name="b")
    assert began(told(act(group(maneuver(faster))), seen))["seen"] == 60


def test_a_speed_is_a_limit_when_it_is_whatever_its_steps_add_up_to():
    """It slows down from 5 m/s from 1 s on, and is no faster than 3 m/s at 2 s."""
    slower = event("e", speeding(1.0, "linear rate 2"), trigger(after(1.0)))
    text = '<SpeedCondition value="3" rule="{}"/>'
    rows = {
        "falls": by("any", "bv", text=text.format("greaterThan"), edge="falling"),
        "equals": by("any", "bv", text=text.format("equalTo")),
        "below": by("any", "bv", text=text.format("lessThan")),
    }
    seen = (event(name, AT_ONCE, trigger(row)) for name, row in rows.items())
    groups = group(maneuver(slower)), group(maneuver(*seen), actors="cv", name="g2")
    instants = began(told(act(*groups)))
    assert instants == {"e": 20, "falls": 40, "equals": 40, "below": 41}


def test_a_delay_is_over_at_the_first_instant_after_it():
    late = event("e", AT_ONCE, trigger(after(1.0, delay=1.02)))
    assert began(told(act(group(maneuver(late))))) == {"e": 41}


@pytest.mark.parametrize("delay", ["4.95", "1e5", "99999999999999999999", "INF"])
def test_a_delay_longer_than_the_scenario_never_ends(delay):
    """It lasts 10 s: a delay of 4.95 s on 5 s is over just in time."""
    made = told(act(group(maneuver(event("e", AT_ONCE, trigger(after(5.0, delay=delay)))))))
    assert began(made) == {"e": 199 if delay == "4.95" else -1}


def test_a_stop_that_never_comes_is_none():
    made = simulator(scenario(("ego",), EGO).replace('"10.0"', '"INF"'))
    assert made.duration == 60.0  # the default, as of a file without a stop trigger


FASTER = '<SpeedCondition value="5.5" rule="greaterThan"/>'


def by(rule, *entities, text=FASTER, edge="none"):
    refs = "".join(f'<EntityRef entityRef="{one}"/>' for one in entities)
    return f"""<Condition name="c" delay="0" conditionEdge="{edge}"><ByEntityCondition>
<TriggeringEntities triggeringEntitiesRule="{rule}">{refs}</TriggeringEntities>
<EntityCondition>{text}</EntityCondition></ByEntityCondition></Condition>"""


@pytest.mark.parametrize(
    ("rule", "entities", "instant"),
    [("any", "bv cv", 21), ("all", "bv cv", 41), ("any", "ego bv", 21), ("all", "ego bv", -1)],
)
def test_any_and_all_of_several_entities(rule, entities, instant):
    """bv is faster from one step after 1 s, cv from one step after 2 s, the ego stands."""
    one = group(maneuver(event("one", AT_ONCE, trigger(after(1.0)))))
    two = group(maneuver(event("two", AT_ONCE, trigger(after(2.0)))), actors="cv", name="g2")
    seen = event("seen", AT_ONCE, trigger(by(rule, *entities.split())))
    watching = group(maneuver(seen), actors="cv", name="g3")
    assert began(told(act(one, two, watching)))["seen"] == instant


def test_triggering_entities_act():
    """Whoever has travelled 10 m brakes: bv (5 m/s) after 2 s; cv (4 m/s) has not by then."""
    cars = EGO + start("bv", lane(3, 1, 90.0), 5.0) + start("cv", lane(4, 1, 90.0), 4.0)
    travelled = '<TraveledDistanceCondition value="9.999"/>'
    brake = event("e", speeding(0.0, "step time 0"), trigger(by("any", "bv", "cv", text=travelled)))
    rollout = told(act(group(maneuver(brake), actors="", selects="true")), privates=cars)
    assert began(rollout) == {"e": 40}
    assert rollout.v[0, 1, 42] == 0.0
    assert rollout.v[0, 2, 42] == 4.0


def test_a_selection_of_entities_acts_and_triggers():
    both = """<EntitySelection name="both"><Members><EntityRef entityRef="bv"/>
<EntityRef entityRef="cv"/></Members></EntitySelection>"""
    cars = """<EntitySelection name="cars"><Members><ByType objectType="vehicle"/></Members>
</EntitySelection>"""
    one = event("one", AT_ONCE, trigger(after(1.0)))
    seen = event("seen", SLOWLY, trigger(by("all", "both")))
    text = scenario(("ego", "bv", "cv"), CARS).replace("</Entities>", both + cars + "</Entities>")
    acts = act(group(maneuver(one), actors="both"), group(maneuver(seen), actors="cars", name="h"))
    rollout = run(text.replace("</Init>", f'</Init><Story name="s">{acts}</Story>'))
    assert began(rollout) == {"one": 20, "seen": 21}
    assert (rollout.v[0, 1:, 21] == 6.0).all()
    assert rollout.v[0, 1:, 61].tolist() == pytest.approx([7.5, 7.5])
    assert rollout.v[0, 0, 61] > 0.0  # the ego is one of the cars


def test_an_element_that_is_not_there_is_refused():
    seen = act(marker("seen", state("event", "nobody", "completeState")))
    with pytest.raises(UnsupportedError, match='storyboardElementRef="nobody"'):
        told(seen)


def without_end(*moves):
    """A scenario of the ego, which stands, and one that drives at 5 m/s; no trigger ends it."""
    privates = start("ego", lane(1, 1, 90.0), 0.0) + start("bv", lane(3, 1, 90.0), 5.0)
    head, _, _ = scenario(("ego", "bv"), privates, events(*moves)).rpartition("<StopTrigger>")
    return f"{head}</Storyboard></OpenSCENARIO>"


def test_without_a_stop_trigger_the_first_act_ends_nothing():
    """It lasts as long as by default, though acts and events start."""
    faster = ("faster", "bv", speeding(20.0, "step time 0"), after(1.0))
    rollout = run(without_end(faster))
    assert int(rollout.n_steps[0]) * rollout.time_step > 3.0
    assert rollout.v[0, 1, 40] == pytest.approx(20.0)


def test_a_storyboard_without_stories_runs():
    """Nobody does anything but go on; there is no trigger at all."""
    rollout = run(without_end())
    assert "<Story " not in without_end()
    assert rollout.v[0, 1, 20] == pytest.approx(5.0)
