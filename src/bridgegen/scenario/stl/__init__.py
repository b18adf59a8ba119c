"""Formulas about signals over time: signal temporal logic (STL), with quantitative robustness.

A text becomes a formula (`parse`), its units are checked (`check_units`), and `robustness` gives
the margin by which each of N recordings satisfies it. Nothing here knows what a scenario is.

Source: Maler and Nickovic, Monitoring temporal properties of continuous signals (FORMATS 2004);
Donze and Maler, Robust satisfaction of temporal logic over real-valued signals (FORMATS 2010).
"""

from bridgegen.scenario.stl.dimensions import Dimension, check_units, dimension_of_unit
from bridgegen.scenario.stl.formula import Formula, Reading, horizon, readings
from bridgegen.scenario.stl.parser import parse
from bridgegen.scenario.stl.robustness import TINY, robustness

__all__ = [
    "TINY",
    "Dimension",
    "Formula",
    "Reading",
    "check_units",
    "dimension_of_unit",
    "horizon",
    "parse",
    "readings",
    "robustness",
]
