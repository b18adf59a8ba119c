"""OpenDRIVE2OWL: a whole map as individuals of layers 1 and 2."""

from bridgegen.openx.opendrive.to_owl.network import individuals_from_opendrive

__all__ = ["individuals_from_opendrive"]
