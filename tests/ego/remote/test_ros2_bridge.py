"""The example of a bridge to Autoware: its bytes, and a drive with a session and a stack of ours.

No Autoware and no Zenoh takes part.
"""

import base64
import importlib.util
import itertools
import math
import sys
import threading
import time
import zlib
from contextlib import suppress
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, strategies
from tests.approval import refuses
from tests.ego.remote.asked import observation, scene

from bridgegen.drivers.remote import serve
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

BRIDGE = Path(__file__).parents[3] / "docs" / "examples" / "ros2_bridge.py"

# Written by PyPI's rosbags 0.11.9 (Apache-2.0), serialize_cdr, of the definitions of ROS 2 Humble
# and of autowarefoundation/autoware_msgs at 7025d8f7: all fields are `numbered`. zlib, base85.
BYTES = {
    "TFMessage": (
        "c-l?Os}6ub3`Ei4A;BRK2to*&WxMG96aSx3;0l^dkC}`rsg@MHHjyi%>34&FjyU0r3$D0%7r&3R&sH)l?Ctat9+=Uv;O"
        "RG+APD6"
    ),
    "Clock": ("c-muNWMBXy1|}c|001Wd1p"),
    "PoseStamped": ("c-muNWMBXy1|}e82I6941}G44fY2gPS^`STKxqXitpuf28~|kK11t"),
    "Odometry": (
        "c-k$=NlHUO7=_WRZoz>A2O=UOAs7>5pS&2G#3uIHh#RP-)zW<MPEkLHkDHC8{n>19tG&M=NAb3s&K>S@kNZ5}A&+>>9{"
        "W7ufTtXC#50b0&I?}hir2j1Ehn6^=`74lGk2PqYvx`v51M(@%#&sonptY*Su-!1dDYCDW>%Vc*UU#}!@|mZ+F4kcFFOk"
        ">^KEBgWq#}|tjw>Sg_T*`*UdjJ#Xcw"
    ),
    "AccelWithCovarianceStamped": (
        "c-k$;Ne%%46h+a84Hy_07>J07h@kXs>1snZVCgEU^YdR$ZdytGY1ix2`xbHCva!cL2OM(5F(;gI#yJ;Ua>X?ZZn))+dm"
        "eb?iDzDT<&AfijX&n0nWtu6nt5yHqnS!q<sT(m7hn"
    ),
    "PredictedObjects": (
        "c-mFe$*vnk6b9gv8-_51T!IkWUb1Y76@(;pF<~CeJclBLC=x@Qgbd4i1U~`P3YJ(134|DG!Laos^dtBY=<EJ+BU(QC{Q"
        "IctxLfLqLlNUAcE&n9*44+R?|0mJ*WE|%x%a;Nk3Mj0_rc>2Mby3h-ye?sYqj^t*0vW1*W+pO37+7SJjqi$%`{mUdotr"
        "GnK6?YPs@xmGUFMU@vO{vPG&qWGhUDxFUpLUWX8)f;}x0ls?3;ACKfivYx*o~jMw#9*cfl<v#>GV)MsI1yrs{=#&}zwg"
        "^lr!J_{S;U40fd#(VlKY>fByS=bmK=(DgfKGbJnV|=8~!p1nO&%(y|Sf7QBktaJQW)@a94vbH%XJTeyW#hm&XFU@$3o9"
        "Fkb7{x9F<qb9hl!bmm5l@Ay!A}XEUf3#cO&0#!=tl<`Q2yMF|)9;abR39mx-B$mF+_MdE}Sr%$xms@C;7O#<Om$lVhD4"
        ">-1P@cJO$*i}q)}nEv|vpMT@f&f!~U?f5Qk@8{_BUd@h8@5i)9_qp}VEUauC7+<(QCT12^HV%w0t!H9pVP)gM_{w@FW)"
        "@a94vb6IGcmKUvT<N6CU@DfXX2ch3l=U}xnkp*12>Gz=CfnZ#5pq;EL^g3#l|%UZWve0XUCq2b7n4BxMbyujcX3vFs_="
        "<jy)6S%v`W=$;uTQ*BrQEd~H5E_Dq~JbHTzTD_3k>bKr(?&3tz3nK)<W;@bbu*W&jjD_3k>bKr(?-Tz?6o{978>6?*nx"
        "8bMT=j&3xa>d3q2W}WQ%w@-(iF4)~>4*L8xA*+p?8jTrp!`0bgMZATj1_;5juq|p`MP`4{_Jn2{{ZONW{U"
    ),
    "Trajectory": (
        "c-muNWMBXy1|}e82I6942%80nSs9Rlgad?@fzk?4S_w+4Kxs87tpTJ192poAfVcpN8-Tb2h$lD-17$_v=9)s)n?Y%FC~"
        "X0yEupj(l(q)a4}j*p0OAio`~!#?oPaKN0sxOP5J~"
    ),
}


def reference(kind):
    return zlib.decompress(base64.b85decode(BYTES[kind]))


def numbered(types, kind, count):
    """Return a message whose fields count up from 1; sequences have two elements."""
    if kind == "string":
        return f"s{next(count)}"
    if kind.startswith("float"):
        _, _, number = kind.partition("*")
        return tuple(float(next(count)) for _ in range(int(number))) if number else next(count)
    if kind.startswith(("int", "uint")):
        _, _, number = kind.partition("*")
        return tuple(next(count) % 200 for _ in range(int(number))) if number else next(count) % 200
    if kind.endswith("[]"):
        return tuple(numbered(types, kind[:-2], count) for _ in range(2))
    return tuple(numbered(types, each, count) for each in types[kind].split())


class Stack:
    """A Zenoh session with a stand-in for Autoware behind it, which answers when the clock moves.

    It accelerates along the route, which it is told beside the messages, as its map.
    """

    def __init__(self, bridge):
        self.bridge, self.heard, self.route = bridge, [], None
        self.is_mute, self.late, self.lag, self.elsewhere = False, 0, 0, 0

    def declare_subscriber(self, key, callback):
        assert key == "planning/trajectory"
        self.callback = callback

    def put(self, key, data):
        self.heard.append((key, data))
        if key == "clock" and not self.is_mute:
            if self.late:
                self.late -= 1
            else:
                self.answer()

    def last(self, key, kind):
        data = next(data for name, data in reversed(self.heard) if name == key)
        return self.bridge.decode(kind, data)

    def answer(self):
        ((seconds, nanoseconds),) = self.last("clock", "Clock")
        stamp = divmod(seconds * 10**9 + nanoseconds - self.lag, 10**9)
        v = self.last("localization/kinematic_state", "Odometry")[3][0][0]
        x, y, h, _ = self.route[0]
        behind = (x - 2.0 * math.cos(h), y - 2.0 * math.sin(h), h, 0.0)
        points = []
        for k, (x, y, h, _) in enumerate([behind, *self.route]):
            speed = min(math.sqrt(v * v + 2.0 * max(k - 1, 0) * 2.0), 8.0) if k < 40 else 0.0
            place = self.bridge.pose(x, y + 50.0 * (self.elsewhere > 0), h)
            points.append(((0, 0), place, speed, 0.0, 0.0, 0.0, 0.0, 0.0))
        self.elsewhere -= 1
        data = self.bridge.encode("Trajectory", ((stamp, "map"), points))
        self.callback(SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: data)))


@pytest.fixture(scope="module")
def bridge():
    spec = importlib.util.spec_from_file_location("ros2_bridge", BRIDGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def stack(bridge, monkeypatch):
    found = Stack(bridge)
    zenoh = ModuleType("zenoh")
    zenoh.Config = lambda: SimpleNamespace(insert_json5=lambda key, value: None)
    zenoh.open = lambda config: found
    monkeypatch.setitem(sys.modules, "zenoh", zenoh)
    return found


def seen(**changed):
    lanes = SimpleNamespace(goal=np.array([[90.0, 1.0, 0.5]] * 3))
    o = observation(**changed).take(np.array([1]))
    return SimpleNamespace(**{**vars(o), "lanes": lanes})


STRAIGHT = np.array([[1.0 + 2.0 * k, 1.0, 0.0, 0.0] for k in range(40)])


@pytest.mark.parametrize("kind", BYTES)
def test_messages_are_those_that_rosbags_writes(bridge, kind):
    message = numbered(bridge.TYPES, kind, itertools.count(1))
    assert bridge.encode(kind, message) == reference(kind)
    assert bridge.decode(kind, reference(kind)) == message


@pytest.mark.parametrize("data", [b"", b"\0\1\0", bytes(24), reference("Trajectory")[:-1]])
def test_bytes_that_are_no_trajectory_are_refused(bridge, data):
    with refuses(ValueError):
        bridge.decode("Trajectory", data)


@given(data=strategies.binary(max_size=200))
def test_any_bytes_are_read_or_refused(bridge, data):
    with suppress(ValueError):
        bridge.decode("Trajectory", bridge.HEAD + data)


def test_an_instant_is_published_before_its_clock(stack, bridge):
    stack.route = STRAIGHT
    driver = bridge.Autoware()
    driver.reset(1, scene())
    tracks = np.zeros((3, 1, 13))
    tracks[1, 0, :10] = 2.0, 30.0, 4.0, math.pi / 2.0, 0.0, 8.0, 4.5, 1.8, 5.0, 0.9
    driver.act(seen(tracks=tracks))
    driver.act(seen(time=0.1, h=np.full(3, 1.02)))
    first = [
        "tf", "localization/kinematic_state", "localization/acceleration",
        "perception/object_recognition/objects",
    ]  # fmt: skip
    goal = "planning/mission_planning/goal"
    assert [key for key, _ in stack.heard] == [*first, "clock", goal, *first, "clock"]
    assert stack.last(goal, "PoseStamped")[1][0] == (90.0, 1.0, 0.0)
    header, _, (pose, _), twist = stack.last("localization/kinematic_state", "Odometry")
    assert header == (divmod(driver.clock, 10**9), "map")
    assert pose[0] == (1.0, 1.0, 0.0)
    assert 2.0 * math.atan2(pose[1][2], pose[1][3]) == pytest.approx(1.02)
    assert twist[:2] == ((1.0, 0.0, 0.0), (0.0, 0.0, pytest.approx(0.2)))
    data = next(data for key, data in stack.heard if key == "perception/object_recognition/objects")
    ((_, sure, label, (where, moves, _, (path,)), (_, _, size)),) = bridge.decode(
        "PredictedObjects", data
    )[1]
    assert label == ((7, pytest.approx(0.9)),)  # a pedestrian
    assert sure == pytest.approx(0.9)
    assert where[0][0] == (30.0, 4.0, 0.0)
    assert moves[0] == pytest.approx((8.0, 0.0, 0.0))  # in its own frame
    assert path[0][2][0] == pytest.approx((30.0, 12.0, 0.0))  # a second later
    assert size == (4.5, 1.8, 1.5)


def test_until_the_first_trajectory_the_clock_runs_and_never_back(stack, bridge):
    stack.route, stack.late = STRAIGHT, 3
    driver = bridge.Autoware()
    for _ in range(2):
        driver.reset(1, scene())
        for k in range(2):
            driver.act(seen(time=0.1 * k))
    clocks = [bridge.decode("Clock", data)[0] for key, data in stack.heard if key == "clock"]
    times = np.array([s * 10**9 + ns for s, ns in clocks])
    assert np.diff(times).tolist() == [10**8] * 4 + [10**9, 10**8]
    assert abs(times[0] - time.time_ns()) < 60 * 10**9
    assert sum(key.endswith("/goal") for key, _ in stack.heard) == 2


def test_a_plan_of_the_last_scenario_is_not_followed(stack, bridge):
    stack.route, stack.elsewhere = STRAIGHT, 2
    driver = bridge.Autoware()
    driver.reset(1, scene())
    assert driver.act(seen()).y[0] == pytest.approx(1.0)
    assert sum(key == "clock" for key, _ in stack.heard) == 3


def test_a_plan_may_be_as_old_as_a_chain_of_nodes_makes_it(stack, bridge, monkeypatch):
    monkeypatch.setattr(bridge, "ANSWER", 0.1)
    stack.route, stack.lag = STRAIGHT, 200_000_000
    driver = bridge.Autoware()
    driver.reset(1, scene())
    driver.act(seen())
    driver.act(seen(time=0.1))
    stack.lag = 400_000_000
    with refuses(TimeoutError):
        driver.act(seen(time=0.2))


@pytest.mark.parametrize("begun", [False, True])
def test_a_stack_that_says_nothing_is_an_error(stack, bridge, monkeypatch, begun):
    monkeypatch.setattr(bridge, "ANSWER", 0.1)
    monkeypatch.setattr(bridge, "START", 0.2)
    stack.route = STRAIGHT
    driver = bridge.Autoware()
    driver.reset(1, scene())
    if begun:
        driver.act(seen())
    stack.is_mute = True
    with refuses(TimeoutError):
        driver.act(seen(time=0.1))  # the earlier plan is no answer


def points(*states):
    """Return points of (x [m], speed [m/s]) along the x axis, with a heading beyond π."""
    turn = (0.0, 0.0, math.sin(math.pi), math.cos(math.pi))
    return [((0, 0), ((x, 0.0, 0.0), turn), v) for x, v in states]


def test_a_trajectory_begins_beside_the_ego_and_its_times_are_those_of_its_speeds(bridge):
    found = bridge.followed(points((-2, 4.0), (0, 4.0), (4, 4.0), (6, 0.0), (8, 0.0)), 1.0, 0.3)
    # 3 m at 4 m/s, 2 m at 2 m/s on average, and there it stands.
    np.testing.assert_allclose(found.time, [0.0, 0.75, 1.75, 11.75])
    np.testing.assert_allclose(found.x, [[1.0, 4.0, 6.0, 6.0]])
    np.testing.assert_allclose(found.v, [[4.0, 4.0, 0.0, 0.0]])


def test_a_trajectory_from_standstill_sets_off_and_one_of_zeros_stands(bridge):
    goes = bridge.followed(points((0, 0.0), (1, 2.0), (3, 2.0)), 0.0, 0.0)
    np.testing.assert_allclose(goes.time, [0.0, 1.0, 2.0, 12.0])
    stands = bridge.followed(points((0, 0.0), (1, 0.0)), 0.5, 0.0)
    np.testing.assert_allclose(stands.time, [0.0, 10.0])
    np.testing.assert_allclose(stands.x, [[0.5, 0.5]])


@pytest.mark.parametrize("states", [[(0, 1.0)], [(1, 1.0), (1, 1.0)], [(0, -1.0), (1, -1.0)]])
def test_what_cannot_be_followed_is_refused(bridge, states):
    with refuses(ValueError):
        bridge.followed(points(*states), 0.0, 0.0)


def test_a_whole_scenario_is_driven_through_the_bytes(stack, bridge, tmp_path):
    class Mapped(bridge.Autoware):
        def act(self, o):
            stack.route = o.route[0].tolist()
            return super().act(o)

    address = f"unix:{tmp_path / 'socket'}"
    threading.Thread(target=serve, args=(Mapped, address), daemon=True).start()
    logical = load("crossroads-s4")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=address))
    drives = [pipeline.rollout(pipeline.space.row({})[np.newaxis]) for _ in range(2)]
    (one, two), n = drives, int(drives[0].n_steps[0])
    assert one.status.tolist() == [0]
    assert np.hypot(np.diff(one.x[0, 0, :n]), np.diff(one.y[0, 0, :n])).sum() > 100.0
    assert np.abs(one.offset[0, :n]).max() < 0.1  # of the route, through the turn
    assert one.v[0, 0, 100:n] == pytest.approx(8.0, abs=0.05)
    np.testing.assert_array_equal(one.x, two.x)
