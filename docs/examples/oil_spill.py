"""The effect of oil-spill.yaml: once the ego is on the oil, the road is more slippery."""


def spill(builder, values):
    """Add an event that changes the road's friction; the parameters give its numbers.

    Args:
        builder: a ``bridgegen.scenario.ontology.builder.Builder`` that holds the scenario so far.
        values: of every parameter, by name; not needed here, as the individuals are bound to them.
    """
    put, quantity = builder.put, builder.quantity
    event = builder.node("oil_spill", "EnvironmentChangeEvent")
    put(event, "has_name", "oil_spill")
    put(builder.iri("scenario"), "has_event", event)

    action = builder.node("oil_spill_action", "EnvironmentAction")
    put(event, "has_what", action)
    weather = builder.node("oil_spill_weather", "Weather")
    put(action, "has_weather", weather)
    road = builder.node("oily_road", "RoadState")
    put(weather, "has_road_state", road)
    quantity(road, "has_friction", "oil_friction")
    quantity(road, "has_wetness", "wetness")

    trigger = builder.node("oil_spill_trigger", "Trigger")
    put(event, "has_when", trigger)
    condition = builder.node("oil_spill_condition", "TraveledDistanceCondition")
    put(trigger, "has_condition", condition)
    put(condition, "has_subject", builder.iri("ego"))
    quantity(condition, "has_value", "oil_at")
