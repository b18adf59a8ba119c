"""Where recorded traffic is on lanes: those of a map, of the recording, or of its paths.

`find.locate` is the way in. A source makes `Strip`s, and `model.assemble` the lanes of them;
`placing` and `neighbours` know no sources.
"""
