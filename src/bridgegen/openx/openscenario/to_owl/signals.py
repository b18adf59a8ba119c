"""OpenSCENARIO2OWL, its traffic lights: controllers with their phases."""

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.signals import LINKS
from bridgegen.openx.openscenario.to_owl.actions import signal_state
from bridgegen.openx.openscenario.to_owl.build import StoryBuilder, UnsayableError
from bridgegen.openx.openscenario.to_owl.entities import as_number
from bridgegen.openx.openscenario.to_owl.parameters import Facts

_LINK_OF = {state: link for link, state in LINKS.items()} | {"red": None}


def add_controllers(builder: StoryBuilder, network: ox.NamedNode, said: Facts) -> list[str]:
    """Add the controllers of the road network's lights; return the names of those added.

    Args:
        builder: where to.
        network: the map's.
        said: by a controller's name, what the header says of it.
    """
    signals = builder.scenario_file.road_network.traffic_signals
    done: list[str] = []
    switched: set[str] = set()
    for one in () if signals is None else signals.controllers:
        name = builder.text(one.name)
        with builder.attempt():
            if name in done:
                raise UnsayableError(one, f"a second TrafficSignalController {name}")
            lights = _add_controller(builder, network, name, one, said.get(name, {}))
            if switched & lights:
                raise UnsayableError(one, f"a second TrafficSignalController of {min(lights)}")
            switched |= lights
            done.append(name)
    return done


def _add_controller(
    builder: StoryBuilder,
    network: ox.NamedNode,
    name: str,
    one: osc.TrafficSignalController,
    facts: dict[str, list[osc.Property]],
) -> set[str]:
    node = builder.node(name, "SignalController")
    builder.put(network, "has_signal_controller", node)
    builder.put(node, "has_name", name)
    passed = facts.get("offset")
    offset = as_number(builder, passed[0].value, passed[0]) if passed else 0.0
    if not one.phases:
        raise UnsayableError(one, f"the TrafficSignalController {name} without a Phase")
    shown = [
        {builder.text(state.traffic_signal_id): state for state in phase.traffic_signal_states}
        for phase in one.phases
    ]
    lights = set(shown[0])
    for light in sorted(lights):
        builder.put(node, "has_light", builder.light(light, shown[0][light]))
    if passed is not None and not 0.0 <= offset < builder.now(one.phases[0].duration, one):
        raise UnsayableError(passed[0], f"an offset of {offset!r} s, not within the first Phase,")
    builder.put(node, "has_offset", offset)
    for number, (phase, states) in enumerate(zip(one.phases, shown, strict=True), start=1):
        if set(states) != lights:
            raise UnsayableError(phase, "a Phase that does not state every light of its controller")
        duration = builder.now(phase.duration, phase)
        if duration <= 0.0:
            raise UnsayableError(phase, f"a Phase of {duration!r} s")
        part = builder.node(f"{name}_phase_{number}", "SignalPhase")
        builder.put(node, "has_phase", part)
        builder.put(part, "has_index", number)
        builder.put(part, "has_name", builder.text(phase.name))
        builder.put(part, "has_duration", duration)
        for light, state in states.items():
            said = signal_state(builder, state.state, state)
            if said not in _LINK_OF:
                raise UnsayableError(state, f"a Phase in which a light is {said}")
            link = _LINK_OF[said]
            if link is not None:
                builder.put(part, link, builder.light(light, state))
    return lights
