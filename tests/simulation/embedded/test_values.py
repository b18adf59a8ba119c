"""Values that change as the scenario runs: parameters, variables, the time of day, lights."""

import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import after, lane, run, scenario, simulator, speeding, start

EGO = start("ego", lane(1, 1, 90.0), 0.0)
MOVE = f"<PrivateAction>{speeding(3.0, 'step time 0')}</PrivateAction>"


def event(name, action, when, count=1):
    return f"""<Event name="{name}" priority="parallel" maximumExecutionCount="{count}">
<Action name="do {name}">{action}</Action><StartTrigger><ConditionGroup>{when}</ConditionGroup>
</StartTrigger></Event>"""


def by_value(text, edge="none"):
    return f"""<Condition name="c" delay="0" conditionEdge="{edge}"><ByValueCondition>{text}
</ByValueCondition></Condition>"""


def everywhere(action):
    return f"<GlobalAction>{action}</GlobalAction>"


def began(*rows, declared="", parameters="", network="", environment="", **values):
    """Return when each event begins; rows are (name, action, condition) and how often it may."""
    events = "".join(event(*row) for row in rows)
    story = f"""<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="ego"/></Actors>
<Maneuver name="m">{events}</Maneuver></ManeuverGroup></Act></Story>"""
    text = scenario(("ego",), EGO, environment=environment, parameters=parameters)
    text = text.replace("</Init>", "</Init>" + story)
    text = text.replace("<CatalogLocations/>", declared + "<CatalogLocations/>")
    text = text.replace("</RoadNetwork>", network + "</RoadNetwork>")
    rollout = run(text, **values)
    found = dict(zip(rollout.event_names, rollout.began.T.tolist(), strict=True))
    return {name: at[0] if len(at) == 1 else at for name, at in found.items()}, rollout


VARIABLES = """<VariableDeclarations>
<VariableDeclaration name="n" variableType="int" value="3"/>
<VariableDeclaration name="x" variableType="double" value="1.5"/>
<VariableDeclaration name="word" variableType="string" value="begin"/>
<VariableDeclaration name="flag" variableType="boolean" value="false"/>
<VariableDeclaration name="day" variableType="dateTime" value="2020-10-01T12:00:00"/>
</VariableDeclarations>"""


def set_(name, change):
    return everywhere(f'<VariableAction variableRef="{name}">{change}</VariableAction>')


def variable(name, value, rule="equalTo"):
    return by_value(f'<VariableCondition variableRef="{name}" value="{value}" rule="{rule}"/>')


ADD = "<ModifyAction><Rule><AddValue value='2'/></Rule></ModifyAction>"
TIMES = "<ModifyAction><Rule><MultiplyByValue value='3'/></Rule></ModifyAction>"


@pytest.mark.parametrize(
    ("change", "seen"),
    [
        (set_("n", '<SetAction value="7"/>'), variable("n", 7)),
        (set_("n", ADD), variable("n", 5)),
        (set_("x", TIMES), variable("x", 4.5)),
        (set_("x", TIMES), variable("x", 4.4, "greaterThan")),
        (set_("word", '<SetAction value="end"/>'), variable("word", "end")),
        (set_("word", '<SetAction value="end"/>'), variable("word", "begin", "notEqualTo")),
        (set_("flag", '<SetAction value="true"/>'), variable("flag", "true")),
        (
            set_("day", '<SetAction value="2020-10-02T00:00:00"/>'),
            variable("day", "2020-10-01T18:00:00", "greaterOrEqual"),
        ),
    ],
)
def test_a_variable_is_set_and_looked_at_one_instant_later(change, seen):
    at, _ = began(("change", change, after(1.0)), ("seen", MOVE, seen), declared=VARIABLES)
    assert at == {"change": 20, "seen": 21}


def test_a_variable_is_set_to_what_is_computed_from_parameters():
    """Each row its own: 2 · 1.5 + 1 = 4, and 2 · 3 + 1 = 7."""
    p = '<ParameterDeclaration name="p" parameterType="double" value="1.5"/>'
    change = set_("x", '<SetAction value="${2 * $p + 1}"/>')
    at, _ = began(
        ("change", change, after(1.0)), ("four", MOVE, variable("x", 4)),
        ("seven", MOVE, variable("x", "${$p + 4}")),
        declared=VARIABLES, parameters=p, p=[1.5, 3.0],
    )  # fmt: skip
    assert at == {"change": [20, 20], "four": [21, -1], "seven": [-1, 21]}
    change = set_("x", '<SetAction value="$p"/>')
    row = ("seen", MOVE, variable("x", 3.0))
    at, _ = began(("change", change, after(1.0)), row, declared=VARIABLES, parameters=p, p=[1.5, 3])
    assert at["seen"] == [-1, 21]


def test_a_variable_has_its_first_value_until_it_is_set():
    at, _ = began(("seen", MOVE, variable("n", 3)), declared=VARIABLES)
    assert at == {"seen": 0}


def test_a_variable_is_set_at_the_start():
    """In the order of the file: (3 + 2) · 3."""
    first = set_("n", ADD) + set_("n", TIMES)
    row = ("seen", MOVE, variable("n", 15))
    assert began(row, declared=VARIABLES, environment=first)[0] == {"seen": 0}
    first = set_("word", '<SetAction value="end"/>')
    row = ("seen", MOVE, variable("word", "begin", "notEqualTo"))
    assert began(row, declared=VARIABLES, environment=first)[0] == {"seen": 0}


def test_an_event_may_add_again_and_again():
    """At 20, 21, 22 and 23: each run ends before the next instant's triggers are looked at."""
    add, look = ("add", set_("n", ADD), after(1.0), 4), ("seen", MOVE, variable("n", 11))
    assert began(add, look, declared=VARIABLES)[0] == {"add": 20, "seen": 24}


def test_what_texts_cannot_do_is_refused():
    for row in (
        ("e", MOVE, variable("word", "end", "lessThan")),
        ("e", MOVE, variable("n", "many")),
        ("e", set_("word", ADD), after(1.0)),
    ):
        with pytest.raises(UnsupportedError):
            began(row, declared=VARIABLES)


def test_a_parameter_s_value_varies_by_row_and_is_changed_by_actions():
    change = everywhere(f'<ParameterAction parameterRef="p">{ADD}</ParameterAction>')
    look = by_value('<ParameterCondition parameterRef="p" value="4" rule="greaterThan"/>')
    declared = '<ParameterDeclaration name="p" parameterType="double" value="1"/>'
    rows = ("change", change, after(1.0)), ("seen", MOVE, look)
    at, _ = began(*rows, parameters=declared, p=[1.0, 3.0, 5.0])
    assert at["seen"] == [-1, 21, 0]


def environment(date, animation):
    return everywhere(
        f"""<EnvironmentAction><Environment name="e"><TimeOfDay animation="{animation}"
dateTime="{date}"/></Environment></EnvironmentAction>"""
    )


def later_than(date, rule="greaterOrEqual"):
    return by_value(f'<TimeOfDayCondition dateTime="{date}" rule="{rule}"/>')


@pytest.mark.parametrize(
    ("environment_", "seen", "at"),
    [
        (environment("2020-10-01T12:00:00", "true"), later_than("2020-10-01T12:00:03"), 60),
        (environment("2020-10-01T12:00:00", "true"), later_than("2020-10-01T14:00:03+02:00"), 60),
        (environment("2020-10-01T12:00:00", "false"), later_than("2020-10-01T12:00:03"), -1),
        (
            environment("2020-10-01T12:00:00", "true"),
            later_than("2020-10-01T12:00:03", "lessThan"),
            0,
        ),
        ("", later_than("1970-01-01T00:00:00"), -1),
    ],
)
def test_the_time_of_day(environment_, seen, at):
    assert began(("seen", MOVE, seen), environment=environment_)[0] == {"seen": at}


def test_an_event_sets_the_time_of_day():
    at, _ = began(
        ("set", environment("2021-01-01T00:00:00", "true"), after(2.0)),
        ("seen", MOVE, later_than("2021-01-01T00:00:01")),
        environment=environment("2020-10-01T12:00:00", "true"),
    )
    assert at == {"set": 40, "seen": 60}


RED, GREEN = "on;off;off", "off;off;on"


def phases(name, *rows, more=""):
    inner = "".join(
        f"""<Phase name="{phase}" duration="{lasts}"><TrafficSignalState trafficSignalId="{light}"
state="{state}"/></Phase>"""
        for phase, lasts, light, state in rows
    )
    return f'<TrafficSignalController name="{name}"{more}>{inner}</TrafficSignalController>'


def signals(*controllers):
    return f"<TrafficSignals>{''.join(controllers)}</TrafficSignals>"


MAIN = phases("main", ("stop", 2.0, "1", RED), ("go", 3.0, "1", GREEN))


def test_controllers_go_through_their_phases_again_and_again():
    _, rollout = began(("e", MOVE, after(9.0)), network=signals(MAIN))
    assert rollout.light_names == ("1",)
    expected = [1 if (k * 0.05) % 5.0 < 2.0 - 1e-9 or (k % 100) == 0 else 4 for k in range(201)]
    assert rollout.lights[0, 0].tolist() == expected


def test_a_delayed_controller_s_cycle_begins_so_much_later():
    """One second later: at the start it is in the last second of its cycle."""
    late = ' delay="1" reference="main"'
    side = phases("side", ("stop", 2.0, "2", RED), ("go", 3.0, "2", GREEN), more=late)
    _, rollout = began(("e", MOVE, after(9.0)), network=signals(MAIN, side))
    main, other = rollout.lights[0]
    assert other[0] == 4
    assert (other[20:] == main[:-20]).all()


def test_an_action_puts_a_controller_into_a_phase():
    action = everywhere(
        """<InfrastructureAction><TrafficSignalAction><TrafficSignalControllerAction
trafficSignalControllerRef="main" phase="go"/></TrafficSignalAction></InfrastructureAction>"""
    )
    _, rollout = began(("e", action, after(1.0)), network=signals(MAIN))
    # red for one second, green for three from then on, and red again
    assert rollout.lights[0, 0, [0, 19, 20, 79, 80, 119, 120]].tolist() == [1, 1, 4, 4, 1, 1, 4]


def light(name, state):
    return everywhere(
        f"""<InfrastructureAction><TrafficSignalAction><TrafficSignalStateAction name="{name}"
state="{state}"/></TrafficSignalAction></InfrastructureAction>"""
    )


def test_conditions_on_lights_and_phases():
    looks = (
        ("green", MOVE, by_value(f'<TrafficSignalCondition name="1" state="{GREEN}"/>')),
        ("flashing", MOVE, by_value('<TrafficSignalCondition name="1" state="flashing"/>')),
        (
            "phase",
            MOVE,
            by_value(
                '<TrafficSignalControllerCondition trafficSignalControllerRef="main" phase="go"/>'
            ),
        ),
        ("set", light("1", "flashing"), after(4.0)),
    )
    at, rollout = began(*looks, network=signals(MAIN))
    assert at == {"green": 40, "flashing": 81, "phase": 40, "set": 80}
    assert rollout.lights[0, 0, 80] > 4  # a state in words of its own
    assert rollout.lights[0, 0, 100] == 1  # until the next phase


def test_the_start_s_state_of_a_light_goes_before_its_phase_s():
    _, rollout = began(
        ("e", MOVE, after(9.0)), network=signals(MAIN), environment=light("1", GREEN)
    )
    assert rollout.lights[0, 0, [0, 39, 40, 100]].tolist() == [4, 4, 4, 1]


def test_a_light_changes_after_an_entity_is_deleted_that_has_its_number():
    """The light, the first, and the ego have number 0."""
    gone = everywhere('<EntityAction entityRef="ego"><DeleteEntityAction/></EntityAction>')
    at, rollout = began(
        ("gone", gone, after(1.0)), ("set", light("1", GREEN), after(1.5)),
        network=signals(MAIN), ego=None,
    )  # fmt: skip
    assert at == {"gone": 20, "set": 30}
    assert rollout.lights[0, 0, [29, 30, 39]].tolist() == [1, 4, 4]


def test_an_end_beyond_all_numbers_is_refused():
    text = scenario(("ego",), start("ego", lane(1, 1, 60.0), 5.0))
    with refuses(UnsupportedError):
        simulator(text.replace('value="10.0" rule', 'value="1e308" rule'))
