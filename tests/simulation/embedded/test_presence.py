"""Entities that are added and deleted: from when on they are there, and what that changes.

On leg C (road 3, straight, south is inward) lane 1 leads south, lane 2 lies 3.5 m to its right;
the instants are 0.05 s apart. A car is 4 m long, its front 3.4 m ahead of its reference point.
"""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.drivers import DRIVERS
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

from .storyboards import (
    after,
    condition,
    crossroads,
    events,
    lane,
    near,
    run,
    scenario,
    speed_action,
    start,
)

EGO = start("ego", lane(1, 1, 90.0), 0.0)


def delete(name: str) -> str:
    return f'<EntityAction entityRef="{name}"><DeleteEntityAction/></EntityAction>'


def add(name: str, place: str) -> str:
    return f"""<EntityAction entityRef="{name}"><AddEntityAction>{place}</AddEntityAction>
</EntityAction>"""


def speed(value: float, dynamics: str = "step time 0") -> str:
    return f"<LongitudinalAction>{speed_action(value, dynamics)}</LongitudinalAction>"


def act(*rows: tuple[str, tuple[str, ...], str], actor: str = "cv") -> str:
    """Events of (name, actions, condition), each in a group of its own."""
    groups = []
    for name, actions, when in rows:
        parts = "".join(
            f'<Action name="{name}{i}">'
            + (
                f"<GlobalAction>{one}</GlobalAction>"
                if one.startswith("<EntityAction")
                else f"<PrivateAction>{one}</PrivateAction>"
            )
            + "</Action>"
            for i, one in enumerate(actions)
        )
        groups.append(
            f"""<ManeuverGroup name="g{name}" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="{actor}"/></Actors>
<Maneuver name="m"><Event name="{name}" priority="parallel" maximumExecutionCount="1">{parts}
<StartTrigger><ConditionGroup>{when}</ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup>"""
        )
    return "".join(groups)


def scene(*rows, names=("ego", "bv", "cv"), privates="", actor="cv", ego="route-follower"):
    bv = start("bv", lane(3, 1, 95.0), 10.0) + start("cv", lane(3, 2, 50.0), 0.0)
    return run(scenario(names, EGO + (privates or bv), act(*rows, actor=actor)), ego)


def there(rollout, name):
    """Return the first and the past-the-last instant at which somebody is there, gaps refused."""
    present = rollout.present[0, rollout.names.index(name), : rollout.n_steps[0]]
    k = np.flatnonzero(present)
    assert (np.diff(k) == 1).all()
    return int(k[0]), int(k[-1]) + 1


def test_who_is_deleted_is_not_there_from_that_instant_on():
    rollout = scene(("gone", (delete("bv"),), after(2.0)))
    assert there(rollout, "bv") == (0, 40)
    assert there(rollout, "ego") == there(rollout, "cv") == (0, 201)
    assert np.ptp(rollout.y[0, 1, 40:]) == 0.0  # states of who is gone do not change
    assert np.isinf(rollout.distance[0, 1, 40:]).all()


def test_files_without_comings_and_goings_record_no_presence():
    assert scene(("set", (speed(3.0),), after(2.0))).present.size == 0


@pytest.mark.parametrize("who", ["bv", "cv"])
def test_nobody_meets_a_condition_that_is_gone(who):
    """bv, at 10 m/s, would be within 20 m of cv, 45 m ahead, after 2.5 s."""
    gone = ("gone", (delete(who),), after(2.0))
    seen = ("seen", (speed(3.0),), near("bv", "cv", 20.4))
    assert scene(gone, seen, actor="ego").began[0, 1] == -1
    assert scene(seen, actor="ego").began[0, 0] == 50


def both(rule, text):
    """A condition on bv and cv, by any or all."""
    return condition("bv", text).replace(
        '"any"><EntityRef entityRef="bv"/>',
        f'"{rule}"><EntityRef entityRef="bv"/><EntityRef entityRef="cv"/>',
    )


@pytest.mark.parametrize(("rule", "at"), [("any", 40), ("all", 41)])
def test_of_all_that_must_meet_a_condition_those_count_that_are_there(rule, at):
    """cv stands from the start, bv never does; bv goes at 2 s, which is seen an instant later."""
    stands = '<SpeedCondition value="0" rule="equalTo"/>'
    gone = ("gone", (delete("bv"),), after(2.0))
    seen = ("seen", (speed(3.0),), both(rule, stands) + after(2.0))
    assert scene(gone, seen, actor="ego").began[0, 1] == at


def test_where_nobody_of_all_is_there_nobody_meets_a_condition():
    gone = ("gone", (delete("bv"), delete("cv")), after(2.0))
    stands = '<SpeedCondition value="99" rule="lessThan"/>'
    seen = ("seen", (speed(3.0),), both("all", stands) + after(2.1))
    assert scene(gone, seen, actor="ego").began[0, 1] == -1


def test_what_somebody_does_that_is_gone_is_over():
    """bv speeds up for 5 s; with bv, after 2 s, goes its action, and so its event ends."""
    ended = """<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="fast"
state="completeState"/></ByValueCondition></Condition>"""
    fast = ("fast", (speed(20.0, "linear time 5"),), after(0.0))
    seen = ("seen", (speed(3.0),), ended)
    gone = ("gone", (delete("bv"),), after(2.0))
    assert scene(fast, seen, actor="bv").began[0, 1] == 100
    # ends with the next instant, and what is asked of who is gone is over as it begins
    assert scene(fast, gone, seen, actor="bv").began[0, 2] == 41


def test_who_goes_by_somebody_that_is_gone_goes_on_as_it_is():
    """cv, 45 m ahead of bv, keeps bv's speed plus 2 m/s, until bv is gone."""
    relative = """<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step"
dynamicsDimension="time" value="0"/><SpeedActionTarget><RelativeTargetSpeed entityRef="bv" value="2"
speedTargetValueType="delta" continuous="true"/></SpeedActionTarget></SpeedAction>
</LongitudinalAction>"""
    follow = ("follow", (relative,), after(0.0))
    gone = ("gone", (delete("bv"),), after(2.0))
    rollout = scene(follow, gone)
    assert rollout.v[0, 2, 1:101] == pytest.approx(12.0)


def test_drivers_do_not_mind_who_is_gone():
    """bv stands 40 m ahead of an ego at 15 m/s, and is gone after 1 s."""
    privates = start("ego", lane(3, 1, 95.0), 15.0) + start("bv", lane(3, 1, 45.0), 0.0)
    privates += start("cv", lane(3, 2, 20.0), 0.0)
    gone = ("gone", (delete("bv"),), after(1.0))
    for ego in ("careful", "careful-fsm", "reference"):
        with_it = scene(privates=privates, ego=ego)
        without = scene(gone, privates=privates, ego=ego)
        assert with_it.v[0, 0, -1] < 1.0, ego
        assert (without.v[0, 0, :20] == with_it.v[0, 0, :20]).all()
        assert without.y[0, 0, without.n_steps[0] - 1] < 30.0, ego  # past where bv stood


def test_sensors_do_not_see_who_is_gone():
    privates = start("ego", lane(3, 1, 95.0), 0.0) + start("bv", lane(3, 1, 65.0), 0.0)
    privates += start("cv", lane(3, 1, 45.0), 0.0)
    rollout = scene(("gone", (delete("bv"),), after(2.0)), privates=privates, ego="reference")
    seen = rollout.detections[0, :, :, 0]
    assert (seen[1, 20:40:2] > 0).all()
    assert (seen[1, 40:] <= 0).all()
    assert (seen[2, 42:200:2] > 0).mean() > 0.9  # whom it hid
    assert (seen[2, 20:40:2] > 0).mean() < 0.5


def hidden(sensors: bool = False, traffic: bool = True) -> str:
    told = f'graphics="true" sensors="{str(sensors).lower()}" traffic="{str(traffic).lower()}"'
    return f"<VisibilityAction {told}/>"


@pytest.mark.parametrize("ego", ["careful", "careful-fsm", "reference"])
def test_the_ego_does_not_see_who_is_hidden_from_sensors(ego):
    """bv stands 50 m ahead and is hidden from the start on: the ego drives into it."""
    privates = start("ego", lane(3, 1, 95.0), 15.0) + start("bv", lane(3, 1, 45.0), 0.0)
    text = scenario(("ego", "bv"), privates)

    def run_with(action):
        told = f"</PrivateAction><PrivateAction>{action}</PrivateAction></Private>"
        at = text.rindex("</PrivateAction>")
        return run(text[:at] + told + text[text.index("</Private>", at) + 10 :], ego)

    seen, unseen = run_with(hidden(sensors=True)), run_with(hidden(traffic=False))
    assert seen.distance[0, 1].min() > 0.0
    assert run_with(hidden(sensors=True, traffic=False)).distance[0, 1].min() > 0.0
    assert unseen.distance[0, 1].min() == 0.0  # it is there all the same


def test_who_is_hidden_may_be_seen_again():
    privates = start("ego", lane(3, 1, 95.0), 0.0) + start("bv", lane(3, 1, 65.0), 0.0)
    story = events(
        ("hide", "bv", hidden(), after(2.0)), ("show", "bv", hidden(sensors=True), after(4.0))
    )
    rollout = run(scenario(("ego", "bv"), privates, story), "reference")
    seen = rollout.detections[0, 1, :, 0] > 0
    assert seen[20:40:2].all()
    assert not seen[42:80].any()
    assert seen[84::2].all()
    assert not rollout.present.size  # it is there all the time


def test_attentive_drivers_do_not_mind_who_is_hidden_from_traffic():
    ahead = start("lead", lane(3, 1, 45.0), 0.0)
    privates = start("ego", lane(1, 1, 90.0), 0.0) + start("bv", lane(3, 1, 95.0), 12.0) + ahead
    names = ("ego", "bv", "lead")
    for action, stops in ((hidden(True, True), True), (hidden(True, False), False)):
        story = events(("hide", "lead", action, after(0.0)))
        rollout = run(scenario(names, privates, story), None, others="attentive")
        assert (rollout.v[0, 1, -1] < 1.0) == stops


LATER = start("cv", lane(3, 2, 50.0), 0.0)
"""bv has no place at the start."""

NOWHERE = f"""<Private entityRef="bv"><PrivateAction>{speed(5.0)}</PrivateAction></Private>"""


def test_who_has_no_place_at_the_start_is_there_once_it_is_added():
    """At 2 s, 60 m from the junction; it goes at once, with the speed that the start gives it."""
    fast = start("bv", lane(3, 1, 95.0), 8.0)
    fast = fast.replace(
        f"<PrivateAction><TeleportAction>{lane(3, 1, 95.0)}</TeleportAction></PrivateAction>", ""
    )
    come = ("come", (add("bv", lane(3, 1, 60.0)),), after(2.0))
    rollout = scene(come, privates=fast + LATER)
    assert there(rollout, "bv") == (40, 201)
    where = scene(privates=start("bv", lane(3, 1, 60.0), 8.0) + LATER)
    for name in ("x", "y", "v"):
        states, wanted = getattr(rollout, name)[0, 1, 40:], getattr(where, name)[0, 1, :161]
        assert states == pytest.approx(wanted, abs=1e-6), name
    assert np.isinf(rollout.distance[0, 1, :40]).all()
    assert np.isfinite(rollout.distance[0, 1, 40:]).all()


def test_what_an_event_asks_of_whom_it_adds_counts_whatever_stands_first():
    for actions in (
        (add("bv", lane(3, 1, 60.0)), speed(5.0)),
        (speed(5.0), add("bv", lane(3, 1, 60.0))),
    ):
        rollout = scene(("come", actions, after(2.0)), privates=LATER, actor="bv")
        y = rollout.y[0, 1]
        assert y[40] - y[60] == pytest.approx(5.0), actions


def test_an_addition_at_the_start_is_a_teleport():
    first = f"<GlobalAction>{add('bv', lane(3, 1, 60.0))}</GlobalAction>"
    text = scenario(("ego", "bv"), EGO, environment=first)
    rollout, wanted = (
        run(text),
        run(scenario(("ego", "bv"), EGO + start("bv", lane(3, 1, 60.0), 0.0))),
    )
    assert rollout.present.size == 0
    assert (rollout.x == wanted.x).all()
    assert (rollout.y == wanted.y).all()


def test_who_is_deleted_at_the_start_is_not_there():
    gone = f"<GlobalAction>{delete('bv')}</GlobalAction>"
    text = scenario(("ego", "bv"), EGO + start("bv", lane(3, 1, 60.0), 0.0), environment=gone)
    assert not run(text).present[0, 1].any()


def test_who_was_deleted_may_be_added_again():
    """bv goes at 1 s, at 10 m/s, comes back at 3 s, 90 m from the junction, and goes on so."""
    rows = (
        ("gone", (delete("bv"),), after(1.0)),
        ("come", (add("bv", lane(3, 1, 90.0)),), after(3.0)),
    )
    for ego in ("route-follower", "reference", "fsm"):
        rollout = scene(*rows, ego=ego)
        present = rollout.present[0, 1]
        assert present[:20].all()
        assert not present[20:60].any()
        assert present[60:].all()
        assert rollout.v[0, 1, 60:100] == pytest.approx(10.0)
        travelled = rollout.y[0, 1, 60] - rollout.y[0, 1, 60:101]
        assert travelled == pytest.approx(0.5 * np.arange(41)), ego
    # all that it has travelled since the start counts: 10 m, and 20 m until 5 s
    text = condition("bv", '<TraveledDistanceCondition value="29.9"/>')
    rollout = scene(*rows, ("seen", (speed(3.0),), text), actor="ego")
    assert rollout.began[0, 2] == 100


def test_who_is_there_already_is_not_added():
    rollout = scene(("come", (add("bv", lane(3, 1, 60.0)),), after(2.0)))
    assert (rollout.y[0, 1] == scene().y[0, 1]).all()


def test_a_place_by_somebody_who_is_not_there_ends_the_row():
    behind = """<Position><RelativeObjectPosition entityRef="cv" dx="-10" dy="0"/></Position>"""
    come = ("come", (add("bv", behind),), after(2.0))
    assert scene(come, privates=LATER).status[0] == 0
    gone = ("gone", (delete("cv"),), after(1.0))
    assert scene(gone, come, privates=LATER).status[0] == 6


def test_who_comes_back_may_count_from_where_it_went():
    """bv goes after 1 s, 85 m from the junction, and comes back 20 m nearer to it."""
    own = """<Position><RelativeLanePosition entityRef="bv" dLane="0" dsLane="20"/></Position>"""
    come = ("come", (add("bv", own),), after(3.0))
    rollout = scene(("gone", (delete("bv"),), after(1.0)), come)
    assert rollout.y[0, 1, 20] - rollout.y[0, 1, 60] == pytest.approx(20.0)
    assert scene(come, privates=LATER).status[0] == 6  # it has never been anywhere


def test_who_is_never_there_is_a_mistake():
    with refuses(InputError, "bv", "TeleportAction"):
        scene(privates=NOWHERE + LATER)
    come = ("come", (add("ego", lane(3, 1, 60.0)),), after(2.0))
    text = scenario(("ego", "cv"), LATER, act(come))
    with refuses(InputError, "ego"):
        run(text)
    assert not run(text, None).present[0, 0, :40].any()  # the storyboard's ego may come later


def test_a_driver_of_one_s_own_is_told_who_is_there():
    """Tracks of who is not there have state 0, with ideal perception and without."""
    rows = (
        ("gone", (delete("bv"),), after(1.0)),
        ("come", (add("bv", lane(3, 1, 80.0)),), after(3.0)),
    )
    privates = start("ego", lane(3, 1, 95.0), 0.0) + start("bv", lane(3, 1, 70.0), 0.0) + LATER
    text = scenario(("ego", "bv", "cv"), privates, act(*rows))
    for ideal in ((), ("perception",)):
        made = EmbeddedSimulator(
            read(text.encode(), "test.xosc"), "test", driver=DRIVERS["reference"].idealised(ideal)
        )
        batch = made.batch(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
        batch.start()
        seen = np.zeros((201, 2))
        tracks, route = np.zeros((1, 2, 12)), np.zeros((1, 3, 4))
        stop, light = np.zeros(1), np.zeros(1, dtype=np.int8)
        for k in range(201):
            batch.before_driver(k)
            batch.observe(k, 1.0, route, tracks, stop, light)
            seen[k] = tracks[0, :, 0]
            batch.after_driver(k, np.zeros(1), np.zeros(1))
        assert (seen[12:20, 0] == 2).all(), ideal
        assert (seen[20:60, 0] == 0).all(), ideal
        assert (seen[72:, 0] == 2).all(), ideal
        assert (seen[12:20, 1] == seen[72, 1]).all(), ideal


def test_the_ego_that_a_driver_drives_does_not_go():
    with refuses(UnsupportedError, "DeleteEntityAction"):
        scene(("gone", (delete("ego"),), after(2.0)))
    rollout = scene(("gone", (delete("ego"),), after(2.0)), ego=None)
    assert there(rollout, "ego") == (0, 40)
    assert np.isinf(rollout.distance[0, 1, 40:]).all()
