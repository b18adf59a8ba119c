"""BridgeGen: safety-critical scenarios for the validation of automated vehicles.

import bridgegen as bg
run = bg.run_search("crossroads-s4", budget=1000, seed=0, out="runs/s4")
run.frame().query("critical").sort_values("d_min").head()
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bridgegen.base import errors
    from bridgegen.engine.simulate import simulate_file
    from bridgegen.jobs.compare.comparison import compare
    from bridgegen.jobs.compare.result import Comparison
    from bridgegen.jobs.credibility.export import export_credibility
    from bridgegen.jobs.dashboard.dashboard import Dashboard, build_dashboard
    from bridgegen.jobs.mine.mine import Mined, mine
    from bridgegen.jobs.preventability.preventability import map_preventability
    from bridgegen.jobs.preventability.result import PreventabilityMap
    from bridgegen.jobs.repair.repair import Repair, repair_driver
    from bridgegen.jobs.risk.result import Risk
    from bridgegen.jobs.risk.risk import estimate_risk
    from bridgegen.jobs.risk.total import TotalRisk, estimate_total_risk
    from bridgegen.jobs.safety_case.export import export_safety_case
    from bridgegen.jobs.safety_case.model import SafetyCase
    from bridgegen.jobs.search import Run, resume, run_search
    from bridgegen.jobs.search.confirm import confirm
    from bridgegen.jobs.search.model import Model, model
    from bridgegen.jobs.search.run import load
    from bridgegen.jobs.suite.difference import DriverDifference, compare_drivers
    from bridgegen.jobs.suite.suite import SuiteRun, run_suite
    from bridgegen.scenario.exposure import Exposure, exposure_of, read_exposure
    from bridgegen.scenario.exposure.fit import Fit, fit_exposure
    from bridgegen.simulation.choice import SimulatorChoice

__all__ = [
    "Comparison",
    "Dashboard",
    "DriverDifference",
    "Exposure",
    "Fit",
    "Mined",
    "Model",
    "PreventabilityMap",
    "Repair",
    "Risk",
    "Run",
    "SafetyCase",
    "SimulatorChoice",
    "SuiteRun",
    "TotalRisk",
    "build_dashboard",
    "compare",
    "compare_drivers",
    "confirm",
    "errors",
    "estimate_risk",
    "estimate_total_risk",
    "export_credibility",
    "export_safety_case",
    "exposure_of",
    "fit_exposure",
    "load",
    "map_preventability",
    "mine",
    "model",
    "read_exposure",
    "repair_driver",
    "resume",
    "run_search",
    "run_suite",
    "simulate_file",
]

_HOMES = {
    "Comparison": "bridgegen.jobs.compare.result",
    "compare": "bridgegen.jobs.compare.comparison",
    "Dashboard": "bridgegen.jobs.dashboard.dashboard",
    "build_dashboard": "bridgegen.jobs.dashboard.dashboard",
    "confirm": "bridgegen.jobs.search.confirm",
    "errors": "bridgegen.base.errors",
    "Mined": "bridgegen.jobs.mine.mine",
    "mine": "bridgegen.jobs.mine.mine",
    "Model": "bridgegen.jobs.search.model",
    "model": "bridgegen.jobs.search.model",
    "Run": "bridgegen.jobs.search",
    "DriverDifference": "bridgegen.jobs.suite.difference",
    "SuiteRun": "bridgegen.jobs.suite.suite",
    "compare_drivers": "bridgegen.jobs.suite.difference",
    "run_suite": "bridgegen.jobs.suite.suite",
    "Exposure": "bridgegen.scenario.exposure",
    "Fit": "bridgegen.scenario.exposure.fit",
    "exposure_of": "bridgegen.scenario.exposure",
    "fit_exposure": "bridgegen.scenario.exposure.fit",
    "read_exposure": "bridgegen.scenario.exposure",
    "load": "bridgegen.jobs.search.run",
    "map_preventability": "bridgegen.jobs.preventability.preventability",
    "PreventabilityMap": "bridgegen.jobs.preventability.result",
    "Repair": "bridgegen.jobs.repair.repair",
    "repair_driver": "bridgegen.jobs.repair.repair",
    "Risk": "bridgegen.jobs.risk.result",
    "estimate_risk": "bridgegen.jobs.risk.risk",
    "TotalRisk": "bridgegen.jobs.risk.total",
    "estimate_total_risk": "bridgegen.jobs.risk.total",
    "resume": "bridgegen.jobs.search",
    "run_search": "bridgegen.jobs.search",
    "export_credibility": "bridgegen.jobs.credibility.export",
    "export_safety_case": "bridgegen.jobs.safety_case.export",
    "SafetyCase": "bridgegen.jobs.safety_case.model",
    "simulate_file": "bridgegen.engine.simulate",
    "SimulatorChoice": "bridgegen.simulation.choice",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for: the command line should start at once."""
    if name == "__version__":
        from importlib.metadata import version

        return version("bridgegen")
    if name not in _HOMES:
        raise AttributeError(f"module 'bridgegen' has no attribute '{name}'")
    from importlib import import_module

    home = import_module(_HOMES[name])
    return home if name == "errors" else getattr(home, name)


def __dir__() -> list[str]:
    """Return the public names, also those not imported yet, so that Tab completes them."""
    return [*__all__, "__version__"]
