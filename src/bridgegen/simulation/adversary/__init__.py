"""A participant driven by an adversary: decisions become a course, and the course a scenario.

The course of a row depends on the row alone: the participant moves along its route as its
decisions say, whatever the others do. So a scenario that an agent has found in closed loop,
deciding by what it saw, is an ordinary row of decisions afterwards: evaluated, recorded and handed
over like any other, as the trajectory that came of it.
"""

from bridgegen.simulation.adversary.arena import OBSERVED, Arena
from bridgegen.simulation.adversary.source import AdversarySource

__all__ = ["OBSERVED", "AdversarySource", "Arena"]
