"""Road networks: the OpenDRIVE model, read, written, made from individuals, checked and travelled.

`model` says what there is, `read` and `write` turn it from and into text, `from_owl` makes it of
an ontology's individuals, `site` finds the intersection of a map, `routes` leads from lane to
lane, `validate` reports errors, `outline` defines the drawing.
"""
