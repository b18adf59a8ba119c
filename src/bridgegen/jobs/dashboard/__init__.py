"""All results of a project as one page: runs, suites, comparisons and preventability maps.

``project.py`` finds and reads them; ``modes.py``, ``requirements.py``, ``trends.py`` and ``odd.py``
say what follows; ``page.py`` writes it, ``home.py`` serves it with all other pages. What a person
decides is in `bridgegen.results.failures`.
"""
