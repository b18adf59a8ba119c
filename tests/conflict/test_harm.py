"""Harm, worked by hand from the table of docs/conflicts.md."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.assess.conflict.analysis import (
    CONTACT,
    COURSE,
    NEAR_MISS,
    NO_CONFLICT,
    ConflictType,
    Responsible,
    Rule,
    Zone,
    analyse,
)
from bridgegen.assess.conflict.harm import closeness_of_pairs, decisive, harm_of_pairs


@pytest.fixture(scope="module")
def found(track, meeting):
    """Build conflicts of the ego with others of which a test says everything that matters."""

    def build(**given):
        others = len(next(iter(given.values())))
        plain = analyse(meeting(*(track(x=100.0 * k) for k in range(others + 1))))
        start = {
            "kind": NO_CONFLICT, "responsible": Responsible.EGO, "nearness": 0.0, "ttc": np.inf,
            "needed": 0.0, "severity": 0.0, "potential": 0.0, "zone_ego": Zone.FRONT,
            "preventable": False,
            "type": ConflictType.CROSSING, "leads_ego": False,
        }  # fmt: skip
        columns = {
            name: np.array([[start[name], *given.get(name, [start[name]] * others)]])
            for name in start
        }
        return replace(plain, **columns)

    return build


def test_half_of_the_time_left_and_half_of_the_brake(found):
    """2 of 4 s, and 3.35 m/s² · ln 2: the urgency is a quarter."""
    needed = 3.35 * np.log(2.0)
    conflicts = found(
        kind=[COURSE, NEAR_MISS, CONTACT], ttc=[2.0, 2.0, 0.0], needed=[needed, needed, 0.0],
        potential=[0.0, 0.04, 0.0001],
    )  # fmt: skip
    found_close = closeness_of_pairs(conflicts, "ego")[0, :3]
    assert found_close.tolist() == pytest.approx([0.0, 0.15, 0.375])
    # a near miss of 4 %: 0.01 x 0.25 x 0.04 is the severity of the contact beside it, 0.0001
    light = 0.3 + 0.7 * np.log(2.0) / np.log(10001.0)
    assert harm_of_pairs(conflicts)[0].tolist() == pytest.approx([0.0, 0.15, light, light])


def test_the_ends_of_each_class(found):
    kinds = [COURSE, COURSE, NEAR_MISS, NEAR_MISS]
    conflicts = found(kind=kinds, ttc=[9.0, 0.0, 4.0, 0.0], needed=[99.0, 1e6, 99.0, 1e6])
    assert closeness_of_pairs(conflicts, "ego")[0, 1:].tolist() == pytest.approx(
        [0.1, 0.3, 0.3, 0.6]
    )
    assert harm_of_pairs(conflicts)[0, 1:].tolist() == pytest.approx([0.1, 0.3, 0.3, 0.3])


def test_a_collision_counts_by_its_severity_alone(found):
    of = [0.0, 0.5, 1.0]
    conflicts = found(kind=[CONTACT] * 3, severity=of, potential=of, ttc=[0.0, 3.0, 0.0])
    half = 0.3 + 0.7 * np.log(5001.0) / np.log(10001.0)
    assert harm_of_pairs(conflicts)[0, 1:].tolist() == pytest.approx([0.3, half, 1.0])
    close = closeness_of_pairs(conflicts, "ego")[0, 1:]
    assert close.tolist() == pytest.approx([0.6, 0.8, 1.0])


def test_no_collision_course_counts_by_nearness(found):
    conflicts = found(kind=[NO_CONFLICT] * 2, nearness=[0.5, 1.0])
    assert harm_of_pairs(conflicts)[0, 1:].tolist() == pytest.approx([0.05, 0.1])


def test_what_the_ego_is_not_to_blame_for_counts_only_among_any(found):
    others = [Responsible.OTHER] * 3
    conflicts = found(kind=[CONTACT, NEAR_MISS, COURSE], responsible=others, ttc=[9.0] * 3)
    assert harm_of_pairs(conflicts)[0, 1:].tolist() == pytest.approx([0.0, 0.0, 0.1])
    assert harm_of_pairs(conflicts, "any")[0, 1:].tolist() == pytest.approx([0.3, 0.3, 0.1])
    assert closeness_of_pairs(conflicts, "any")[0, 1:].tolist() == pytest.approx([0.6, 0.3, 0.1])


@pytest.mark.parametrize(
    ("responsible", "preventable", "zone", "kind", "type_", "failed"),
    [
        (Responsible.EGO, False, Zone.REAR, CONTACT, ConflictType.CROSSING, True),
        (Responsible.SHARED, False, Zone.REAR, NEAR_MISS, ConflictType.CROSSING, True),
        (Responsible.OTHER, True, Zone.FRONT, CONTACT, ConflictType.CROSSING, True),
        (Responsible.NONE, True, Zone.FRONT_LEFT, CONTACT, ConflictType.HEAD_ON, True),
        (Responsible.OTHER, False, Zone.FRONT, CONTACT, ConflictType.CROSSING, False),
        (Responsible.OTHER, True, Zone.LEFT, CONTACT, ConflictType.CROSSING, False),
        (Responsible.OTHER, True, Zone.FRONT, NEAR_MISS, ConflictType.CROSSING, False),
        (Responsible.OTHER, True, Zone.FRONT, CONTACT, ConflictType.SIDE_SWIPE, False),
        (Responsible.OTHER, True, Zone.FRONT, CONTACT, ConflictType.EGO_STANDING, False),
    ],
)
def test_when_the_ego_has_failed(found, responsible, preventable, zone, kind, type_, failed):
    """It is responsible, or its front meets in a contact that it could have prevented."""
    conflicts = found(
        responsible=[responsible], preventable=[preventable], zone_ego=[zone], kind=[kind],
        type=[type_], leads_ego=[zone in (Zone.FRONT, Zone.FRONT_LEFT)],
    )  # fmt: skip
    assert bool(conflicts.at_fault[0, 1]) is failed


def test_a_collision_decides_and_below_a_course_what_happened(found):
    """A light touch decides before a near miss of more harm, which is the row's harm."""
    conflicts = found(
        kind=[COURSE, CONTACT, NEAR_MISS], ttc=[9.0, 0.0, 0.0], needed=[0.0, 0.0, 1e6],
        potential=[0.0, 0.0001, 0.04],
    )  # fmt: skip
    near = 0.3 + 0.7 * np.log(5.0) / np.log(10001.0)  # 0.01 x 0.04 is four times 0.0001
    assert [one.tolist() for one in decisive(conflicts)] == [[2], pytest.approx([near])]
    # Not the ego's: both are harmless, and so is the one that passes; the contact goes first.
    others = [Responsible.OTHER] * 3
    conflicts = found(
        kind=[NO_CONFLICT, NEAR_MISS, CONTACT], responsible=others, nearness=[0.9, 0.0, 0.0]
    )
    assert [one.tolist() for one in decisive(conflicts)] == [[3], pytest.approx([0.09])]


def test_rules_are_called_by_their_names():
    assert Rule.NONE.label == ""
    assert Rule.STRUCK_STANDING.label == "struck standing"
