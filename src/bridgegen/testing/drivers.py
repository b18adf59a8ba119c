"""The contract of drivers: what ``bridgegen validate`` checks."""

from collections.abc import Sequence
from functools import cache

import pytest

from bridgegen.jobs.search.driver_contract import IN_SHORT, SCENARIOS, Check, check_driver

RULES = tuple(rule for rules in IN_SHORT.values() for rule in rules)


@cache
def _checks(driver: str, scenarios: tuple[str, ...], time_limit: float | None) -> tuple[Check, ...]:
    return tuple(check_driver(driver, scenarios, time_limit=time_limit))


class DriverContract:
    """What every driver must do; inherit from it, and pytest runs its tests.

    Attributes:
        driver: as ``--ego`` takes it: ``package.module:Class``, ``file.py:Class``, a compiled
            driver's function, ``file.fmu``, ``exec:COMMAND`` …
        scenarios: names of the catalogue, or paths.
        time_limit: [s] that one call may take; the default of ``--time-limit`` if None.
    """

    driver: str
    scenarios: Sequence[str] = SCENARIOS
    time_limit: float | None = None

    @pytest.mark.parametrize("rule", RULES)
    def test_it_keeps_a_rule(self, rule: str) -> None:
        checks = _checks(self.driver, tuple(self.scenarios), self.time_limit)
        found = [check for check in checks if check.rule == rule]
        problems = [f"{check.scenario}: {check.problem}" for check in found if check.problem]
        assert not problems, f"{rule}: {'; '.join(problems)}"
        if not found:
            pytest.skip("not checked, since the driver breaks another rule")
