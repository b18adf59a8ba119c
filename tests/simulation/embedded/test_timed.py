"""Trajectories with times: who follows one is where its vertices say, when they say."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.drivers import DRIVERS
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.embedded.compiler.trajectories import timetable
from bridgegen.simulation.embedded.motion._follow_kernels import at_time
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

from .storyboards import (
    condition,
    crossroads,
    event,
    lane,
    near,
    scenario,
    speed_action,
    start,
)

STEPS = np.arange(201) * 0.05


def vertex(time, x: float, y: float, h: float | None = None) -> str:
    heading = "" if h is None else f' h="{h!r}"'
    timed = "" if time is None else f' time="{time}"'
    place = f'<Position><WorldPosition x="{x!r}" y="{y!r}"{heading}/></Position>'
    return f"<Vertex{timed}>{place}</Vertex>"


def timed(name: str, *vertices: str, timing: str = "", more: str = "") -> str:
    timing = timing or 'domainAbsoluteRelative="absolute" scale="1" offset="0"'
    return f"""<Private entityRef="{name}"><PrivateAction><TeleportAction><Position>
<WorldPosition x="0" y="0"/></Position></TeleportAction></PrivateAction><PrivateAction>
<RoutingAction><FollowTrajectoryAction{more}><TimeReference><Timing {timing}/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><Polyline>{"".join(vertices)}</Polyline></Shape></Trajectory></TrajectoryRef>
</FollowTrajectoryAction></RoutingAction></PrivateAction></Private>"""


def play(text: str, driver: str | None = None):
    simulator = EmbeddedSimulator(
        read(text.encode(), "test.xosc"), "test.xosc", driver=DRIVERS[driver] if driver else None
    )
    return simulator.run(simulator.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})


EGO = start("ego", lane(1, -1, 10), 10)
LINE = (vertex(0, 0.0, 0.0), vertex(2, 20.0, 0.0), vertex(3, 20.0, 5.0))


def test_linear_between_vertices_and_on_at_its_last_speed():
    out = play(scenario(("ego", "bv"), EGO + timed("bv", *LINE)))
    assert out.x[0, 1, :41] == pytest.approx(10.0 * STEPS[:41])
    assert out.y[0, 1, 40:61] == pytest.approx(5.0 * (STEPS[40:61] - 2.0))
    assert out.x[0, 1, 60:] == pytest.approx(20.0)
    assert out.y[0, 1, 60:] == pytest.approx(5.0 + 5.0 * (STEPS[60:] - 3.0))
    assert out.v[0, 1, :41] == pytest.approx(10.0)  # at a vertex, of the line that ends there
    assert out.v[0, 1, 41:] == pytest.approx(5.0)
    assert out.h[0, 1, 30] == 0.0
    assert out.h[0, 1, 100] == pytest.approx(math.pi / 2)
    assert out.a[0, 1, 40] == pytest.approx(-100.0)
    assert out.a[0, 1, 60:] == pytest.approx(0.0)
    assert (out.offset[0, 1] == 0.0).all()
    assert out.status[0] == 0


def test_a_trajectory_at_the_start_is_a_place_to_start_at():
    there = timed("bv", *LINE)
    alone = there[: there.index("<PrivateAction>")] + there[there.index("<PrivateAction>\n<Rout") :]
    a, b = (play(scenario(("ego", "bv"), EGO + one)) for one in (there, alone))
    assert (a.x == b.x).all()
    assert (a.y == b.y).all()


def test_the_ego_too_and_nobody_drives_it():
    text = scenario(("ego", "bv"), timed("ego", *LINE) + start("bv", lane(1, -1, 10), 10))
    out = play(text)
    assert out.x[0, 0, :41] == pytest.approx(10.0 * STEPS[:41])
    assert out.n_steps[0] == 201  # the end of its line is not the scenario's
    made = EmbeddedSimulator(read(text.encode()), "test")
    assert made.driver == "storyboard"
    with refuses(UnsupportedError, "reference"):
        play(text, "reference")


def test_a_scale_and_an_offset_of_time():
    timing = 'domainAbsoluteRelative="relative" scale="2" offset="1"'
    out = play(scenario(("ego", "bv"), EGO + timed("bv", *LINE, timing=timing)))
    assert (out.x[0, 1, :21] == 0.0).all()
    assert (out.v[0, 1, :20] == 0.0).all()
    assert out.x[0, 1, 20:101] == pytest.approx(5.0 * (STEPS[20:101] - 1.0))
    assert out.y[0, 1, 140] == 5.0  # at 2 · 3 s + 1 s


def test_headings_turn_the_short_way_round_and_go_on():
    corners = [vertex(k, 3.0 * k, 0.0, math.remainder(2.5 * k, math.tau)) for k in range(8)]
    out = play(scenario(("ego", "bv"), EGO + timed("bv", *corners)))
    assert out.h[0, 1, :141] == pytest.approx(2.5 * STEPS[:141], abs=1e-12)


def test_somebody_who_only_stands():
    there = [vertex(t, 5.0, 6.0, 1.0) for t in (0, 9)]
    out = play(scenario(("ego", "bv"), EGO + timed("bv", *there)), "reference")
    assert (out.x[0, 1] == 5.0).all()
    assert (out.h[0, 1] == 1.0).all()
    assert (out.v[0, 1] == 0.0).all()


def test_others_meet_who_follows_a_timetable():
    """Conditions see it, and the reference driver brakes for it."""
    ego = start("ego", lane(1, -1, 10), 10)
    free = play(scenario(("ego",), ego), "reference")
    x, y, h = (float(getattr(free, field)[0, 0, 0]) for field in ("x", "y", "h"))
    ahead = [vertex(t, x + (30 + t) * math.cos(h), y + (30 + t) * math.sin(h), h) for t in (0, 10)]
    out = play(scenario(("ego", "bv"), ego + timed("bv", *ahead)), "reference")
    assert out.distance[0, 1].min() > 0.5
    assert out.v[0, 0, -1] < 2.0
    gone = condition("bv", '<TraveledDistanceCondition value="4.99"/>')
    out = play(scenario(("ego", "bv"), ego + timed("bv", *ahead), stop=(gone,)), "route-follower")
    assert out.n_steps[0] == 101  # at 1 m/s, 4.99 m lie between 4.95 and 5 s


def test_events_tell_when_they_began():
    text = event("ego", speed_action(5.0), near("ego", "bv", 30.0))
    out = play(scenario(("ego", "bv"), EGO + start("bv", lane(1, -1, 60), 0), text))
    apart = np.hypot(out.x[0, 1] - out.x[0, 0], out.y[0, 1] - out.y[0, 0])
    assert out.event_names == ("e",)
    assert out.began.tolist() == [[int(np.argmax(apart <= 30.0))]]
    never = event("ego", speed_action(5.0), near("ego", "bv", 0.1))
    assert play(scenario(("ego", "bv"), EGO + start("bv", lane(2, -1, 60), 0), never)).began == -1


@pytest.mark.parametrize(
    ("privates", "events", "text"),
    [
        (timed("bv", vertex(1, 0.0, 0.0), vertex(1, 1.0, 0.0)), "", "1 s"),
    ],
)  # fmt: skip
def test_refusals(privates, events, text):
    with refuses(UnsupportedError, text):
        play(scenario(("ego", "bv"), EGO + privates, events))


@pytest.mark.parametrize(
    ("vertices", "text"),
    [
        ([vertex(0, 0.0, 0.0), vertex("INF", 1.0, 0.0)], "Vertex"),
        ([vertex(0, 0.0, 0.0), '<Vertex time="1"><Position><WorldPosition x="INF" y="0"/>'
          "</Position></Vertex>"], "finite"),
        ([vertex(0, 0.0, 0.0), vertex(1, 1e6, 0.0)], "100000 m"),
    ],
)  # fmt: skip
def test_hostile_numbers(vertices, text):
    with refuses(InputError, text):
        play(scenario(("ego", "bv"), EGO + timed("bv", *vertices)))


_METRES = st.floats(-100.0, 100.0)


@st.composite
def tables(draw):
    n = draw(st.integers(2, 12))
    times = np.cumsum(draw(st.lists(st.floats(0.01, 3.0), min_size=n, max_size=n)))
    corners = [
        (draw(_METRES), draw(_METRES), draw(st.none() | st.floats(-7.0, 7.0))) for _ in range(n)
    ]
    return corners, times.tolist()


@given(tables())
def test_laws_of_a_timetable(made):
    corners, times = made
    rows = timetable(corners, times)

    def states(instants):
        return np.array([at_time(rows, len(rows), t) for t in instants])

    at = states(times)
    assert (at[:, :2] == [corner[:2] for corner in corners]).all()
    leg = np.hypot(*np.diff(at[:, :2], axis=0).T)
    assert at[1:, 3] == pytest.approx(leg / np.diff(times), abs=1e-9)
    assert at[:, 4] == pytest.approx(np.append(0.0, np.cumsum(leg)))
    for k, (_, _, h) in enumerate(corners[1:], 1):
        if h is not None and corners[k - 1][2] is not None:
            assert math.remainder(at[k, 2] - h, math.tau) == pytest.approx(0.0, abs=1e-9)
    fine = np.linspace(times[0] - 1.0, times[-1] + 1.0, 40)
    table = states(fine)
    for column in (0, 1):
        expected = np.interp(fine, times, [corner[column] for corner in corners])
        assert table[:, column] == pytest.approx(expected, abs=1e-9)
    assert (table[:, 3] >= 0.0).all()
    assert (np.diff(table[:, 4]) >= -1e-9).all()
    assert (table[fine < times[0] - 1e-6, 3] == 0.0).all()
