"""What other tools write: the standard does not ask that it be refused, or it can be made sense of.

On leg C (road 3, straight, south is inward) lane 1 leads south; the instants are 0.05 s apart.
"""

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.validate import problems

from .storyboards import after, events, lane, run, scenario, simulator, speeding, start, vehicle
from .test_laid import RELATIVE, follow, part, place, told, vertex, world
from .test_towing import CONNECT, trailer

NAMES = ("ego", "bv", "lead")
STARTS = "".join(
    start(name, where, speed)
    for name, where, speed in (
        ("ego", lane(1, 1, 90.0), 0.0),
        ("bv", lane(3, 1, 90.0), 5.0),
        ("lead", lane(3, 1, 70.0), 5.0),
    )
)


def keep(value: str, side: str = "any", parameters: str = "") -> str:
    """A file in which bv, 20 m behind lead, keeps a distance to it from 1 s on."""
    beside = f' displacement="{side}"' if side else ""
    action = f"""<LongitudinalAction><LongitudinalDistanceAction entityRef="lead" {value}
freespace="false" continuous="true" coordinateSystem="lane"{beside}/></LongitudinalAction>"""
    rows = events(("keep", "bv", action, after(1.0)))
    return scenario(NAMES, STARTS, rows, parameters=parameters)


def behind(text: str, **values: list[float]) -> np.ndarray:
    """How far bv is behind lead at 3 s [m], per row."""
    out = run(text, None, **values)
    return out.y[:, 1, 60] - out.y[:, 2, 60]


@pytest.mark.parametrize(
    ("side", "version", "expected"),
    [
        ("any", 2, 12.0),
        ("", 2, 12.0),
        ("leadingReferencedEntity", 2, -12.0),
        ("", 0, -12.0),  # 1.0 has no displacement: there the sign is what other tools say it by
    ],
)
def test_a_distance_below_0_counts_by_its_size(side, version, expected):
    text = keep('distance="-12"', side).replace('revMinor="2"', f'revMinor="{version}"')
    assert problems(read(text.encode())) == []
    assert behind(text) == pytest.approx([expected])
    approve(simulator(text, None).program.notes, "-12 m", "lead")


def test_so_does_one_that_rows_vary_and_a_time_gap():
    declared = '<ParameterDeclaration name="d" parameterType="double" value="-12"/>'
    text = keep('distance="$d"', parameters=declared)
    assert behind(text, d=[-12.0, -7.0, 15.0]) == pytest.approx([12.0, 7.0, 15.0])
    assert behind(keep('timeGap="-2"')) == pytest.approx([10.0])


def test_names_that_nothing_refers_to_may_occur_twice():
    """Two conditions of one group are called c."""
    both = after(1.0) + after(1.5)
    text = scenario(NAMES, STARTS, events(("e", "bv", speeding(8.0, "step time 0"), both)))
    assert problems(read(text.encode())) == []
    assert np.argmax(run(text, None).v[0, 1] > 5.0) == pytest.approx(31, abs=1)


def test_missing_times_of_a_chain_of_clothoids_follow_from_its_lengths():
    """10 m in 5 s; then 10 m of which 4 are in 4 s, so at 1 m/s."""
    second = part("", 10, 5.0)
    for timed, end in ((' timeEnd="10"', 20.0), ("", 20.0)):
        shape = f"<ClothoidSpline{timed}>{part(world(0, 73, 0.0), 10)}{second}</ClothoidSpline>"
        out = told((follow(shape, RELATIVE), after(1.0)))
        assert place(out, 3.5)[:2] == pytest.approx((5.0, 73.0), abs=1e-6)
        assert place(out, 6.0)[:2] == pytest.approx((10.0, 73.0), abs=1e-6)
        assert place(out, 8.5)[:2] == pytest.approx((10.0 + (end - 10.0) / 2, 73.0), abs=1e-6)
    story = events(("e", "bv", follow(shape, RELATIVE), after(1.0)))
    (note,) = simulator(scenario(NAMES, STARTS, story), None).program.notes
    approve(note, "2 of its 3 times are missing")


def line(*stated: tuple[float, float | None]) -> str:
    return f"<Polyline>{''.join(vertex(world(x, 50), time) for x, time in stated)}</Polyline>"


def test_missing_times_of_a_line_too():
    """At 2 m/s to 4 m, at 5 m/s to 14, and on at that speed."""
    shape = line((0, None), (3, None), (4, 2), (14, 4), (24, None))
    out = told((follow(shape, RELATIVE), after(1.0)))
    for seconds, x in ((1.0, 0.0), (2.0, 2.0), (3.0, 4.0), (4.0, 9.0), (6.0, 19.0), (7.0, 24.0)):
        assert place(out, seconds + 0.05)[:2] == pytest.approx((x, 50.0), abs=0.26)
    with refuses(InputError, "do not increase"):
        told((follow(line((0, 0), (5, None), (5, None), (9, 3)), RELATIVE), after(1.0)))
    out = told((follow(line((0, 3), (30, None)), RELATIVE), after(1.0)))  # one time: its own speed
    assert place(out, 2.0)[:2] == pytest.approx((10.0, 50.0), abs=0.6)


def test_a_line_with_times_may_be_begun_further_on():
    """From 4 m on, of a line of 10 m at 2 m/s and 20 m at 5 m/s, each as fast as it says."""
    shape, beyond = line((0, 0), (10, 5), (30, 9)), ' initialDistanceOffset="{}"'
    out = told((follow(shape, RELATIVE, beyond.format(4)), after(1.0)))
    for seconds, x in ((1.0, 4.0), (2.0, 6.0), (4.0, 10.0), (5.0, 15.0), (8.0, 30.0)):
        assert place(out, seconds + 0.05)[:2] == pytest.approx((x, 50.0), abs=0.26)
    assert out.v[0, 1, 50] == pytest.approx(2.0)
    assert out.v[0, 1, 120] == pytest.approx(5.0)
    with refuses(InputError, "30"):
        told((follow(shape, RELATIVE, beyond.format(30)), after(1.0)))


def test_whom_nothing_places_or_moves_is_absent():
    text = scenario((*NAMES, "lost"), STARTS)
    (note,) = simulator(text, None).program.notes
    approve(note, "'lost' is absent")
    out = run(text, None)
    assert not out.present[0, 3].any()
    assert np.array_equal(out.x[:, :3], run(scenario(NAMES, STARTS), None).x)
    with refuses(InputError, "TeleportAction"):  # a search without the ego would mean nothing
        run(scenario(NAMES, STARTS.replace('Private entityRef="ego"', 'Private entityRef="bv"')))


def test_a_body_without_a_wheelbase_or_a_width_and_a_time_below_0():
    at_once = after(1.0).replace('value="1.0"', 'value="-1"')
    assert at_once != after(1.0)
    text = scenario(NAMES, STARTS, events(("e", "bv", speeding(8.0, "step time 0"), at_once)))
    odd = vehicle("bv").replace('positionX="2.8"', 'positionX="0"').replace('"2.0"', '"0"')
    text = text.replace(vehicle("bv"), odd)
    assert problems(read(text.encode())) == []
    approve(simulator(text, None).program.notes, "FrontAxle")
    assert run(text, None).v[0, 1, 5] == 8.0


def test_a_trailer_that_is_coupled_at_the_start():
    """As by an event at 0 s."""
    hitch = vehicle("bv").replace("</Vehicle>", '<TrailerHitch dx="-1"/></Vehicle>')
    apart = start("trailer", lane(3, 1, 96.0), 0.0)
    initial = STARTS + f'<Private entityRef="bv"><PrivateAction>{CONNECT}</PrivateAction></Private>'
    ours, theirs = (
        run(
            scenario(NAMES, privates + apart, story)
            .replace(vehicle("bv"), hitch)
            .replace("</Entities>", trailer("trailer") + "</Entities>"),
            None,
        )
        for privates, story in (
            (initial, ""),
            (STARTS, events(("couple", "bv", CONNECT, after(0.0)))),
        )
    )
    assert np.array_equal(ours.y, theirs.y)
    assert ours.v[0, 3, -1] == pytest.approx(5.0)
