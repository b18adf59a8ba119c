"""The block ``recorded`` of scenario files: which events, and their parameters."""

import numpy as np
import pytest

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.reader import load, shipped_text
from bridgegen.scenario.language.storyboard import unmapped


@pytest.fixture
def written(tmp_path):
    """Return a function that writes lead-brakes with a block of its own."""

    def write(block):
        head, _, rest = shipped_text("lead-brakes").decode().partition("\nrecorded:")
        _, _, end = rest.partition("\nobjective:")
        path = tmp_path / "lead-brakes.yaml"
        path.write_text(f"{head}\n{block}\nobjective:{end}", encoding="utf-8")
        return load(path)

    return write


def test_formulas_give_parameters_of_quantities(written):
    scenario = written("recorded: {event: cut-in, where: gap > 1, parameters: {gap: 2*gap + 1}}")
    quantities = {"gap": np.array([0.5, 2.0, np.nan]), "ego_speed": np.ones(3)}
    assert scenario.recorded.counts(quantities).tolist() == [False, True, False]
    np.testing.assert_array_equal(scenario.recorded.values(quantities)["gap"], [2.0, 5.0, np.nan])
    left_out = unmapped(scenario.recorded, scenario.parameters)
    assert left_out == ("ego_speed", "deceleration", "low_speed", "brake_time")


def test_the_block_does_not_change_the_scenario(written):
    """Runs of before stay valid: what is simulated is the same."""
    block = "recorded: {event: lead-brakes, parameters: {gap: gap}}"
    assert written(block).fingerprint == written("").fingerprint


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("{event: cut-inn, parameters: {gap: gap}}", "unknown event 'cut-inn'; did you mean"),
        ("{event: cut-in, parameters: {gap: gapp}}", "'gapp', which is no quantity of 'cut-in'"),
        ("{event: cut-in, parameters: {gip: gap}}", "unknown parameter 'gip'; did you mean 'gap'"),
        ("{event: cut-in, parameters: {lead_at: gap}}", "lead_at is derived"),
        ("{event: cut-in, parameters: {gap: gap +}}", "cannot read the formula"),
        ("{event: cut-in, parameters: {}}", "must name a parameter"),
        ("{event: cut-in, where: revealed_gap > 1, parameters: {gap: gap}}", "recorded.where"),
        ("{parameters: {gap: gap}}", "recorded must have the key 'event'"),
        ("{event: cut-in, parameters: {gap: gap}, were: gap > 1}", "unknown key 'were'"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(written, block, message):
    with pytest.raises(ScenarioError) as error:
        written(f"recorded: {block}")
    assert message in str(error.value)
    assert "lead-brakes.yaml, line " in str(error.value)
    assert len(error.value.problems) == 1
