"""BridgeGen: safety-critical scenarios for the validation of automated vehicles.

import bridgegen as bg
run = bg.run_search("crossroads-s4", budget=1000, seed=0, out="runs/s4")
run.frame().query("critical").sort_values("d_min").head()
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bridgegen.campaign import Run, resume, run_search
    from bridgegen.campaign.confirm import confirm
    from bridgegen.comparison import Comparison, compare
    from bridgegen.dashboard import Dashboard, build_dashboard
    from bridgegen.exposure import Exposure, exposure_of, read_exposure
    from bridgegen.exposure.fit import Fit, fit_exposure
    from bridgegen.odd.reader import load
    from bridgegen.preventability import PreventabilityMap, map_preventability
    from bridgegen.risk import Risk, estimate_risk
    from bridgegen.safety_case import SafetyCase, export_safety_case
    from bridgegen.simulate import simulate_file
    from bridgegen.simulation.choice import SimulatorChoice

__all__ = [
    "Comparison",
    "Dashboard",
    "Exposure",
    "Fit",
    "PreventabilityMap",
    "Risk",
    "Run",
    "SafetyCase",
    "SimulatorChoice",
    "build_dashboard",
    "compare",
    "confirm",
    "estimate_risk",
    "export_safety_case",
    "exposure_of",
    "fit_exposure",
    "load",
    "map_preventability",
    "read_exposure",
    "resume",
    "run_search",
    "simulate_file",
]

_HOMES = {
    "Comparison": "bridgegen.comparison",
    "compare": "bridgegen.comparison",
    "Dashboard": "bridgegen.dashboard",
    "build_dashboard": "bridgegen.dashboard",
    "confirm": "bridgegen.campaign.confirm",
    "Run": "bridgegen.campaign",
    "Exposure": "bridgegen.exposure",
    "Fit": "bridgegen.exposure.fit",
    "exposure_of": "bridgegen.exposure",
    "fit_exposure": "bridgegen.exposure.fit",
    "read_exposure": "bridgegen.exposure",
    "load": "bridgegen.odd.reader",
    "map_preventability": "bridgegen.preventability",
    "PreventabilityMap": "bridgegen.preventability",
    "Risk": "bridgegen.risk",
    "estimate_risk": "bridgegen.risk",
    "resume": "bridgegen.campaign",
    "run_search": "bridgegen.campaign",
    "export_safety_case": "bridgegen.safety_case",
    "SafetyCase": "bridgegen.safety_case",
    "simulate_file": "bridgegen.simulate",
    "SimulatorChoice": "bridgegen.simulation.choice",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for: the command line should start at once."""
    if name not in _HOMES:
        raise AttributeError(f"module 'bridgegen' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return all names, also those not imported yet, so that Tab completes them."""
    return sorted({*globals(), *__all__})
