"""The options of a run, each declared once: `SearchOptions` and the parts of it that stages take.

The command line, the keywords of ``run_search`` and ``compare``, the recorded settings and the
command that reproduces a run are all derived from these declarations. Imports nothing slow: the
command line needs it to start.
"""

from bridgegen.engine.options.option import Option, called_with, checked, options_of, range_problems
from bridgegen.engine.options.search import CommonOptions, PipelineOptions, SearchOptions

__all__ = [
    "CommonOptions",
    "Option",
    "PipelineOptions",
    "SearchOptions",
    "called_with",
    "checked",
    "options_of",
    "range_problems",
]
