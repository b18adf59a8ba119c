"""OWL2OpenDRIVE: the roads of a scenario's individuals as a road network."""

from bridgegen.openx.opendrive.from_owl.network import opendrive_from_owl

__all__ = ["opendrive_from_owl"]
