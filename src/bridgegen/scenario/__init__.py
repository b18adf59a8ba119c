"""What can be said of a scenario, and what keeps it real: its language, constraints and ontology.

Also the tables of participants and weather, exposures, signal temporal logic, and the scenarios
that ship. Imports `base`.
"""
