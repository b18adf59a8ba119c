"""Who works on a batch: threads of this process, processes of this machine, a Ray cluster.

``Workers`` is what all of them do; ``open_workers`` makes those that a user asks for. They are
given a `Recipe`, plain data from which a worker makes what works (a pipeline with its compiled
plan, or its connection to a simulator), and rows. What comes of a row depends on that row alone,
so no result depends on who did it, on how many there are, or on who died.
"""

from bridgegen.workers.carried import CarriedDriver
from bridgegen.workers.choice import Choice, open_workers, read_choice
from bridgegen.workers.recipe import Recipe
from bridgegen.workers.threads import Threads
from bridgegen.workers.workers import Lost, Part, Workers

__all__ = [
    "CarriedDriver",
    "Choice",
    "Lost",
    "Part",
    "Recipe",
    "Threads",
    "Workers",
    "open_workers",
    "read_choice",
]
