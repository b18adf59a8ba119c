"""Scenarios as knowledge: ``bridgegen.owl``, the individuals of one scenario, their files, shapes.

``individuals.build`` turns one row of X into individuals; the converters in ``openx`` read them
through ``graph.Individuals``; ``files`` saves and loads them as ``.owl``; ``shapes`` compiles the
constraints of ``odd`` to SHACL and ``check`` runs them and describes violations in words.
"""
