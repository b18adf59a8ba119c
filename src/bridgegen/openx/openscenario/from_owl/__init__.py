"""OWL2OpenSCENARIO: layers 3 to 5 of a scenario's individuals as a storyboard."""

from bridgegen.openx.openscenario.from_owl.scenario import openscenario_from_owl

__all__ = ["openscenario_from_owl"]
