"""Lanes that come with recordings: CommonRoad's lanelets, highD's markings."""

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.recordings import writers as w

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.lanes.find import locate
from bridgegen.recordings.lanes.lanelets import lanes_of_lanelets
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.table import Lanelet

UPPER, LOWER = "-12.0;-8.0;-4.0", "2.0;6.0;10.0;13.5"


def bound(side, x, y):
    points = "".join(f"<point><x>{a}</x><y>{b}</y></point>" for a, b in zip(x, y, strict=True))
    return f"<{side}Bound>{points}</{side}Bound>"


def with_lanelets(folder):
    """Write a CommonRoad file with two lanes along x, cut at x = 50 m, and a crosswalk."""
    path = w.write_commonroad(folder)
    text = []
    for i, x in enumerate(((0.0, 20.0, 50.0), (50.0, 120.0))):
        for k, (right, left) in enumerate(((-9.5, -6.0), (-6.0, -2.5))):
            beside = '<adjacentLeft ref="{0}1" drivingDir="same"/>' if k == 0 else (
                '<adjacentRight ref="{0}0" drivingDir="same"/>')  # fmt: skip
            # One bound of two points, the other of as many as there are.
            text.append(
                f'<lanelet id="{i}{k}">{bound("left", x, [left] * len(x))}'
                f"{bound('right', (x[0], x[-1]), [right] * 2)}"
                f"{beside.format(i)}{'' if i else f'<successor ref={chr(34)}1{k}{chr(34)}/>'}"
                f'<successor ref="999"/><laneletType>urban</laneletType></lanelet>'
            )
    text.append(f'<lanelet id="9">{bound("left", (30.0, 30.0), (-9.5, -2.5))}'
                f'{bound("right", (33.0, 33.0), (-9.5, -2.5))}'
                "<laneletType>crosswalk</laneletType></lanelet>")  # fmt: skip
    whole = path.read_text().replace('<dynamicObstacle id="1">', "".join(text)
                                     + '<dynamicObstacle id="1">', 1)  # fmt: skip
    path.write_text(whole)
    return path


def test_states_are_on_commonroads_lanelets(tmp_path):
    (traffic,) = read(with_lanelets(tmp_path))
    found = locate(clean(traffic).traffic)
    after, lanes, placed = clean(traffic).traffic, found.lanes, found.placed
    assert lanes.source == "lanelets"
    assert lanes.names == ("00", "01", "10", "11")
    assert set(lanes.carriageway) == {0}
    assert placed.on_lane.all()
    row = np.where(after.y > -6.0, 1, 0)
    names = np.array(lanes.names)[placed.lane]
    assert (names == np.char.add(np.where(after.x > 50.0, "1", "0"), row.astype(str))).all()
    np.testing.assert_array_equal(lanes.number[placed.lane], row + 1)
    np.testing.assert_allclose(placed.station, after.x, atol=1e-9)
    np.testing.assert_allclose(placed.offset, after.y - np.where(row, -4.25, -7.75), atol=1e-6)
    np.testing.assert_allclose(placed.along, after.vx, atol=1e-5)
    np.testing.assert_allclose(placed.across, after.vy, atol=1e-5)
    assert found.fit.km_off == 0.0
    assert found.fit.km_on == pytest.approx(after.kilometres)
    assert found.fit.states.sum() == len(after.time)


def test_a_lanelet_needs_two_points_on_each_bound(tmp_path):
    path = with_lanelets(tmp_path)
    path.write_text(path.read_text().replace("<point><x>0.0</x><y>-9.5</y></point>", "", 1))
    with refuses(FileFormatError):
        list(read(path))


def highd(folder, upper=UPPER, lower=LOWER):
    path = w.write_highd(folder)
    (folder / "01_recordingMeta.csv").write_text(
        f"id,frameRate,locationId,upperLaneMarkings,lowerLaneMarkings\n1,10,2,{upper},{lower}\n"
    )
    return path


def test_highds_markings_are_lanes_with_its_own_numbers(tmp_path):
    (traffic,) = read(highd(tmp_path))
    after = clean(traffic).traffic
    found = locate(after)
    lanes, placed = found.lanes, found.placed
    assert lanes.source == "markings"
    assert lanes.names == ("2", "3", "5", "6", "7")
    np.testing.assert_array_equal(lanes.number, [1, 2, 3, 2, 1])
    np.testing.assert_array_equal(lanes.left, [1, -1, -1, 2, 3])
    assert (placed.lane[after.y > -6.0] == 2).all()
    assert (placed.lane[after.y < -6.0] == 3).all()
    heading = lanes.heading[lanes.first[:-1]]
    np.testing.assert_allclose(heading, [np.pi, np.pi, 0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(lanes.width[lanes.first[:-1]], [4.0, 4.0, 4.0, 4.0, 3.5])


@pytest.mark.parametrize("upper", ["-4.0;-8.0", "a;b", "nan;1"])
def test_markings_must_ascend(tmp_path, upper):
    with refuses(FileFormatError, "recordingMeta.csv", "line 2"):
        list(read(highd(tmp_path, upper=upper)))


def test_lanelets_of_another_place_are_not_used(tmp_path):
    path = with_lanelets(tmp_path)
    text = path.read_text()
    for y in ("-9.5", "-6.0", "-2.5"):
        text = text.replace(f"<y>{y}</y>", f"<y>{float(y) + 100.0}</y>")
    path.write_text(text)
    (traffic,) = read(path)
    found = locate(clean(traffic).traffic)
    assert found.lanes.source == "none"
    approve(found.lanes.notes[0], "used")


def test_lanes_as_wide_as_a_country_are_refused(tmp_path):
    (traffic,) = read(highd(tmp_path, lower="2.0;6.0;1e8"))
    with refuses(FileFormatError, "08 m"):
        locate(clean(traffic).traffic)


def test_lanelets_beyond_the_earth_are_refused(tmp_path):
    path = with_lanelets(tmp_path)
    path.write_text(path.read_text().replace("<x>120.0</x>", "<x>1e200</x>"))
    with refuses(FileFormatError):
        list(read(path))


def test_a_ring_of_lanelets_has_an_end():
    angle = np.linspace(0.0, np.pi / 2, 20)
    lanelets = []
    for k in range(4):
        turn = angle + k * np.pi / 2
        rim = np.column_stack([np.cos(turn), np.sin(turn)])
        lanelets.append(Lanelet(str(k), 18.0 * rim, 22.0 * rim, successors=(str((k + 1) % 4),)))
    lanes = lanes_of_lanelets(lanelets)
    assert set(lanes.carriageway) == {0}
    begin = lanes.station[lanes.first[:-1]]
    np.testing.assert_allclose(begin, np.arange(4) * 20.0 * np.pi / 2, rtol=1e-3)
