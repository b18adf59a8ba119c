"""The ontology names the attributes of operational design domains that its terms state."""

from importlib.resources import files

import pyoxigraph as ox

from bridgegen.scenario.odd.states import table

BG = "https://w3id.org/bridgegen#"


def stated():
    """Attributes by term, as ``taxonomy.yaml`` has them."""
    found = {}
    for concept in table().concepts.values():
        evidence = {concept.quantity, *concept.facts.values()} - {"", "never", "always"}
        evidence |= {kind for kinds in concept.types.values() for kind in kinds}
        for each in evidence:
            for term in table().terms[each]:
                found.setdefault(term, set()).add(concept.name)
    return found


def test_each_term_names_the_attributes_that_it_states():
    store = ox.Store()
    store.load(
        files("bridgegen.scenario.ontology").joinpath("bridgegen.owl").read_bytes(),
        ox.RdfFormat.RDF_XML,
        base_iri=BG[:-1],
    )
    found = {}
    for quad in store.quads_for_pattern(None, ox.NamedNode(f"{BG}odd_attribute"), None, None):
        found.setdefault(quad.subject.value.removeprefix(BG), set()).add(quad.object.value)
    assert found == stated()
