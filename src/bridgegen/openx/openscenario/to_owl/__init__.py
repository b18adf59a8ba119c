"""OpenSCENARIO2OWL: a storyboard as individuals of layers 3 to 5."""

from bridgegen.openx.openscenario.to_owl.scenario import individuals_from_openscenario

__all__ = ["individuals_from_openscenario"]
