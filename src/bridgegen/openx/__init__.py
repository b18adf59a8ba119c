"""OpenDRIVE and OpenSCENARIO: models, readers, writers, checks, and the way there from OWL."""
