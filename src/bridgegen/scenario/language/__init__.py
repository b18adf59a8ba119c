"""The operational design domain: what may vary, within what, and why.

A logical scenario (``scenario``) declares parameters along five axes and the constraints between
them (``parameters``, in the formulas of ``expression``), each once and with its source. The search
space (``space``) turns any point of the unit cube into a row that keeps all of them.
"""
