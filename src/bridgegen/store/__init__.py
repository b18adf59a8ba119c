"""A run's results, append-only, in one SQLite file that any SQLite client can query.

``Store.create`` creates a run's folder, ``Store.open`` reads it or resumes it.
"""

from bridgegen.store.checkpoint import Checkpoint
from bridgegen.store.recorded import Recorded
from bridgegen.store.rows import Evaluated, Rows
from bridgegen.store.run_file import refuse_used
from bridgegen.store.store import Store

__all__ = ["Checkpoint", "Evaluated", "Recorded", "Rows", "Store", "refuse_used"]
