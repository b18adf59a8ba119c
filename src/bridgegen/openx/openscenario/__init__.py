"""OpenSCENARIO XML: a declared model, its reader and writer, and OWL2OpenSCENARIO.

``model`` is the whole model by the standard's names, ``read`` and ``write`` turn files into it and
back, ``parameters`` evaluates and checks what is declared as ``$name``, ``validate`` says what is
wrong with a scenario, and ``from_owl`` makes one from the individuals of the ontology.
"""
