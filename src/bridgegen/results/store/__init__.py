"""A run's results, append-only, in one SQLite file that any SQLite client can query.

``Store.create`` creates a run's folder, ``Store.open`` reads it or resumes it.
"""

from bridgegen.results.store.recorded import Recorded
from bridgegen.results.store.rows import Evaluated, Rows
from bridgegen.results.store.run_file import refuse_used
from bridgegen.results.store.sqlite import Checkpoint
from bridgegen.results.store.store import Store

__all__ = ["Checkpoint", "Evaluated", "Recorded", "Rows", "Store", "refuse_used"]
