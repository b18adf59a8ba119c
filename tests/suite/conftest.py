"""A folder of scenario files: one alone, and one with a distribution that excludes a third."""

import pytest
from tests.campaign.braking import deterministic, distribution_text, scenario_text, write_pair

DISTRIBUTION = deterministic(
    ("EgoSpeed", '<DistributionSet><Element value="8"/><Element value="10"/><Element value="14"/>'
     "</DistributionSet>"),
    ("Gap", '<DistributionSet><Element value="18"/><Element value="40"/></DistributionSet>'),
)  # fmt: skip

_GAP = '<ParameterDeclaration name="Gap" parameterType="double" value="30"'
_CONSTRAINT = (
    '><ConstraintGroup><ValueConstraint rule="greaterOrEqual" value="${2 * $EgoSpeed}"/>'
    "</ConstraintGroup></ParameterDeclaration>"
)


@pytest.fixture
def folder(tmp_path):
    """Return it; the gap must be at least what is driven in 2 s."""
    made = tmp_path / "files"
    (made / "sub").mkdir(parents=True)
    scenario, ranges = write_pair(made)
    scenario.rename(made / "plain.xosc")
    ranges.unlink()
    text = scenario_text().replace(f"{_GAP}/>", _GAP + _CONSTRAINT)
    (made / "varied.xosc").write_text(text, "utf-8")
    distribution = distribution_text(DISTRIBUTION, "varied.xosc")
    (made / "varied_distribution.xosc").write_text(distribution, "utf-8")
    return made
