"""Operational design domains as files: ASAM OpenODD 1.0 in YAML, and what they say of scenarios.

``reader`` reads a file and its imports, ``states`` says what a scenario states of the attributes
that ``taxonomy.yaml`` lists, ``bounding`` bounds a scenario by an ODD, ``domain`` writes and
judges the current operational domain of a row, and counts what rows cover of an ODD.
"""
