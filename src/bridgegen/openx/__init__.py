"""Files in and out: OpenDRIVE and OpenSCENARIO are read, written, checked, and converted.

Both ways between these files and the ontology, and places on maps. Imports `scenario` and below.
"""
