"""Cross-simulator validation: rollouts of two simulators are compared, explained and recorded.

``compare.py`` finds where two rollouts of one scenario diverge; ``words.py`` explains it in
sentences; ``record.py`` stores it in the run's folder; ``summary.py`` has its key figures.
"""
