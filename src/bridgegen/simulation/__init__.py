"""Motion: rows of parameters in, rollouts out, by one protocol for several simulators.

A simulator is one folder (`embedded`, `esmini`); installed packages add others by entry points.
Imports `drivers` and below.
"""
