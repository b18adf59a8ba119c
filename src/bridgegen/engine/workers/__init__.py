"""Workers evaluate a batch: threads of this process, processes of this machine, a Ray cluster.

`Workers` is their protocol; ``open_workers`` makes the workers that a user asks for. Each worker
gets a `Recipe`, plain data from which it builds what evaluates rows (a pipeline with its compiled
plan, or its connection to a simulator), and rows. The result of a row depends on that row alone, so
no result depends on the kind of workers, on their number or on which of them crashed.
"""

from bridgegen.engine.workers.choice import Choice, open_workers, read_choice
from bridgegen.engine.workers.recipe import CarriedDriver, Recipe
from bridgegen.engine.workers.threads import Threads
from bridgegen.engine.workers.workers import Lost, Part, Stream, Workers

__all__ = [
    "CarriedDriver",
    "Choice",
    "Lost",
    "Part",
    "Recipe",
    "Stream",
    "Threads",
    "Workers",
    "open_workers",
    "read_choice",
]
