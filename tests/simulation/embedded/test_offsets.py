"""Bodies beside their lane's centre; and what rows may not vary.

The bv drives south on leg C's inner lane (id 1, from 90 m before the junction at x = -1.75); what
is left of the road's direction (north, away from the junction) is west of it.
"""

import numpy as np
from tests.approval import refuses

from bridgegen.base.errors import InputError

from .storyboards import after, events, lane, lateral, run, scenario, start

EGO = start("ego", lane(1, 1, 90.0), 0.0, lane(1, 1, 90.0), lane(3, -1, 50.0))
PARAMETER = '<ParameterDeclaration name="aside" parameterType="double" value="0.5"/>'


def beside(offset, *rows, **values):
    place = lane(3, 1, 90.0).replace('s="90.0"', f's="90.0" offset="{offset}"')
    bv = start("bv", place, 5.0)
    return run(scenario(("ego", "bv"), EGO + bv, events(*rows), parameters=PARAMETER), **values)


def test_an_offset_is_kept_along_the_lane():
    on, off = beside(0.0), beside(1.2)
    np.testing.assert_allclose(off.x[0, 1], on.x[0, 1] - 1.2, atol=1e-12)
    np.testing.assert_allclose(off.y[0, 1], on.y[0, 1], atol=1e-12)
    np.testing.assert_array_equal(off.h, on.h)


def test_rows_may_vary_it_and_a_literal_gives_the_same_bits():
    rollout = beside("$aside", aside=[0.0, 0.5, -1.0])
    for row, offset in enumerate((0.0, 0.5, -1.0)):
        literal = beside(offset)
        np.testing.assert_array_equal(rollout.x[row], literal.x[0])
        np.testing.assert_array_equal(rollout.y[row], literal.y[0])
        np.testing.assert_array_equal(rollout.distance[row], literal.distance[0])


def test_a_lane_change_leads_to_the_centre_of_the_other_lane():
    to_the_right = ("e", "bv", lateral(-1, "sinusoidal time 3"), after(1.0))
    plain, off = beside(0.0, to_the_right), beside(1.2, to_the_right)
    k = round(4.5 / plain.time_step)
    np.testing.assert_allclose(off.x[0, 1, k:], plain.x[0, 1, k:], atol=1e-9)
    jump = np.hypot(np.diff(off.x[0, 1]), np.diff(off.y[0, 1])).max()
    assert jump < 5.0 * plain.time_step * 1.2  # it slides over, without a leap


def test_the_egos_offset_must_be_the_same_in_every_row():
    place = lane(1, 1, 90.0).replace('s="90.0"', 's="90.0" offset="$aside"')
    ego = start("ego", place, 5.0, lane(1, 1, 90.0), lane(3, -1, 50.0))
    text = scenario(("ego", "bv"), ego + start("bv", lane(3, 1, 90.0), 5.0), parameters=PARAMETER)
    assert (run(text, aside=[0.5, 0.5]).status == 0).all()
    with refuses(InputError, "aside", "0.5"):
        run(text, aside=[0.5, 0.6])


def test_a_box_must_be_the_same_in_every_row():
    text = scenario(("ego", "bv"), EGO + start("bv", lane(3, 1, 90.0), 5.0), parameters=PARAMETER)
    text = text.replace('length="4.0"', 'length="$aside"', 1)
    assert run(text, aside=[0.5]).box[0, 0] == 0.5
    with refuses(InputError):
        run(text, aside=[3.0])
