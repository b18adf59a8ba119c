"""Is what one simulator found so in another one? Rollouts compared, put in words, and recorded.

``compare.py`` finds where two rollouts of one scenario part; ``words.py`` says it; ``record.py``
keeps it in a run's folder; ``summary.py`` is what it comes to.
"""
