"""OpenSCENARIO DSL 2.x (``.osc``), the part that logical scenarios need, as a scenario file's data.

`parser` reads a file, `names` what it and its imports declare, and `story` writes the drive()s of
its scenario as the participants, events and parameters of a YAML file, which everything else reads.
"""
