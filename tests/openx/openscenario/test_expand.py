"""A scenario that was read stands by itself: what its parameters were, where they stood."""

import pytest
from tests.approval import approve

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import to_xml

from .files import car, declared, entity, maneuver, parameter, scenario, speed, story


def speeds(scenario: osc.OpenScenario) -> list[object]:
    return [one.value for one in walk(scenario) if isinstance(one, osc.AbsoluteTargetSpeed)]


def problems(text: str) -> str:
    with pytest.raises(FileFormatError) as caught:
        read(text.encode())
    return str(caught.value)


def test_the_innermost_declaration_counts_and_the_outer_one_again_after_it():
    inner = maneuver(
        speed("$v", "one"), speed("${$v + 1}", "two"),
        declared=declared(parameter("v", "double", "3")),
    )  # fmt: skip
    outer = maneuver(speed("$v", "three"), name="n")
    text = scenario(
        declared=declared(parameter("v", "double", "1")),
        stories=story(inner + outer, declared=declared(parameter("v", "double", "2"))),
    )
    found = read(text.encode())
    assert [one if isinstance(one, float) else float(one.resolve({})) for one in speeds(found)] == [
        3.0,
        4.0,
        2.0,
    ]
    assert not [one for one in walk(found) if getattr(one, "parameter_declarations", None)
                and not isinstance(one, osc.OpenScenario)]  # fmt: skip
    assert read(to_xml(found)) == found


def test_the_scenario_s_own_parameters_stay_and_what_is_made_of_them_depends_on_them():
    text = scenario(
        declared=declared(
            parameter("b", "double", "${$a * 2}"),
            parameter("a", "double", "5"),
            parameter("c", "double", "$b"),
        ),
        stories=story(
            maneuver(
                speed("$a", "one"), speed("$b", "two"), speed("${$c - $d}", "three"),
                declared=declared(parameter("d", "double", "$a")),
            )
        ),
    )  # fmt: skip
    found = read(text.encode())
    assert parameters.values(found) == {"a": 5.0}
    for a in (5.0, 7.5):
        values = [float(one.resolve({"a": a})) for one in speeds(found)]
        assert values == [a, 2 * a, 2 * a - a]


def test_a_local_name_does_not_capture_the_scenario_s_own():
    """``v`` is handed down as ``w``, then hidden by another ``v``: ``w`` stays what it was."""
    text = scenario(
        declared=declared(parameter("v", "double", "5")),
        stories=story(
            maneuver(
                speed("${$w + $v}"),
                declared=declared(parameter("v", "double", "100")),
            ),
            declared=declared(parameter("w", "double", "${2 * $v}")),
        ),
    )
    (value,) = speeds(read(text.encode()))
    assert float(value.resolve({"v": 5.0})) == 110.0
    assert float(value.resolve({"v": 6.0})) == 112.0


def test_texts_enumerations_and_whole_numbers_by_their_types():
    body = car(
        name="$n", width="$w",
        declared=declared(
            parameter("n", "string", "a car"), parameter("w", "integer", "2"),
        ),
    ).replace('vehicleCategory="car"', 'vehicleCategory="$kind"')  # fmt: skip
    body = body.replace("<ParameterDeclarations>", "<ParameterDeclarations>" + parameter(
        "kind", "string", "truck"))  # fmt: skip
    vehicle = read(scenario(entities=entity(body)).encode()).entities.scenario_objects[0]
    assert vehicle.entity_object.name == "a car"
    assert vehicle.entity_object.vehicle_category is osc.VehicleCategory.TRUCK
    assert vehicle.entity_object.bounding_box.dimensions.width == 2.0


def test_a_text_may_stand_for_the_number_that_it_reads_as():
    text = scenario(
        declared=declared(parameter("v", "string", "12.5"), parameter("name", "string", "x")),
        stories=story(maneuver(speed("$v"), speed("${$v * 2}", "two"))),
    )
    first, second = speeds(read(text.encode()))
    assert first == 12.5
    assert float(second.resolve({}) if isinstance(second, osc.Expr) else second) == 25.0
    approve(problems(text.replace('value="$v"', 'value="$name"')), "string")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("$nobody", "value of AbsoluteTargetSpeed refers to $nobody, which is not declared"),
        ("${$nobody}", "refers to $nobody, which is not declared"),
        ("$flag", "must be of type double, $flag is a boolean"),
        ("$word", "must be of type double, $word is a string"),
        ("$later", "the value of parameter later refers to $last, which is not declared"),
        ("$zero", "the value of parameter zero must be finite, got ${1/($o)}"),
        ("$own", "the value of parameter own refers to $own, which is not declared"),
        ("$small", "parameter small must be greaterThan 3, got 2"),
    ],
)
def test_what_does_not_fit_is_said_with_its_line(value, text):
    local = declared(
        parameter("flag", "boolean", "true"), parameter("word", "string", "so"),
        *(
            {"$later": [parameter("later", "double", "$last"), parameter("last", "double", "1")],
             "$zero": [parameter("o", "double", "0"), parameter("zero", "double", "${1/$o}")],
             "$own": [parameter("own", "double", "${$own + 1}")],
             "$small": [parameter("small", "double", "2").replace("/>",
                 '><ConstraintGroup><ValueConstraint rule="greaterThan" value="3"/>'
                 "</ConstraintGroup></ParameterDeclaration>")],
             }.get(value, [])
        ),
    )  # fmt: skip
    said = problems(scenario(stories=story(maneuver(speed(value), declared=local))))
    if text.startswith("the value of parameter zero"):
        text = text.partition(", got")[0]
    assert text in said
    assert "(line 3)" in said


FLAGS = declared(
    parameter("dry", "boolean", "true"), parameter("dark", "boolean", "0"),
    parameter("n", "int", "3"),
)  # fmt: skip


def clock(animation: str) -> str:
    """A scenario whose clock stands or goes."""
    return scenario(
        declared=FLAGS,
        init='<GlobalAction><EnvironmentAction><Environment name="e"><TimeOfDay '
        f'animation="{animation}" dateTime="2025-01-01T00:00:00"/></Environment>'
        "</EnvironmentAction></GlobalAction>",
    )


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("${not $dry}", False),
        ("${$dry and not $dark}", True),
        ("${$dark or false}", False),
        ("${not ($dark or $dry)}", False),
        ("${true}", True),
    ],
)
def test_booleans_are_worked_out(text, value):
    found = read(clock(text).encode())
    (time,) = [one for one in walk(found) if isinstance(one, osc.TimeOfDay)]
    assert time.animation is value


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("${$n}", "animation of TimeOfDay must be a boolean, ${$n} is a number"),
        ("${not $n}", "takes a number of $n for not, and, or"),
        ("${$dry + 1}", "takes a boolean of $dry for arithmetic"),
        ("${-true}", "is true or false, a number is needed"),
        ("${$dry and 1}", "takes a number for not, and, or"),
    ],
)
def test_numbers_and_booleans_are_not_mixed(text, said):
    assert said in problems(clock(text))


def test_a_number_is_no_boolean():
    text = scenario(declared=FLAGS, stories=story(maneuver(speed("${not $dry}"))))
    approve(problems(text), "boolean")


def test_expressions_that_double_each_time_are_refused():
    """Thirty parameters, each twice the one before: a gigabyte, if it were written out."""
    many = [parameter("p0", "double", "1")]
    many += [parameter(f"p{k}", "double", f"${{$p{k - 1} + $p{k - 1}}}") for k in range(1, 31)]
    text = scenario(declared=declared(*many), stories=story(maneuver(speed("$p30"))))
    approve(problems(text), "20000")


def test_what_is_made_of_literals_alone_is_a_literal():
    text = scenario(
        stories=story(
            maneuver(speed("$v"), declared=declared(parameter("v", "double", "${50 / 4}")))
        )
    )
    assert speeds(read(text.encode())) == [12.5]


def test_a_parameter_that_an_action_names_becomes_the_scenario_s_own():
    action = (
        '<Event name="e" priority="parallel"><Action name="a"><GlobalAction><ParameterAction '
        'parameterRef="$v"><SetAction value="${$v * 2}"/></ParameterAction></GlobalAction></Action>'
        "</Event>"
    )
    text = scenario(
        declared=declared(parameter("v", "double", "1")),
        stories=story(
            maneuver(action, declared=declared(parameter("v", "double", "3")))
            + maneuver(action.replace('"e"', '"f"'), name="n"),
        ),
    )
    found = read(text.encode())
    names = [one.parameter_ref for one in walk(found) if isinstance(one, osc.ParameterAction)]
    assert names == ["v_2", "v"]
    assert parameters.values(found) == {"v": 1.0, "v_2": 3.0}
    assert read(to_xml(found)) == found


def test_a_parameter_that_nobody_declares_cannot_be_set():
    action = (
        '<Event name="e" priority="parallel"><Action name="a"><GlobalAction><ParameterAction '
        'parameterRef="v"><SetAction value="1"/></ParameterAction></GlobalAction></Action></Event>'
    )
    said = problems(scenario(stories=story(maneuver(action))))
    approve(said, "v", "ParameterAction")


SELECTION = '<EntitySelection name="{name}"><Members>{members}</Members></EntitySelection>'


def test_the_members_of_a_selection_stand_for_it():
    two = entity(car()) + entity(car(), "other")
    two += SELECTION.format(name="pair", members='<EntityRef entityRef="other"/>'
                                                 '<EntityRef entityRef="ego"/>')  # fmt: skip
    two += SELECTION.format(name="cars", members='<ByType objectType="vehicle"/>')
    init = (
        '<Private entityRef="pair"><PrivateAction><TeleportAction><Position><WorldPosition x="0" '
        'y="0"/></Position></TeleportAction></PrivateAction></Private>'
    )
    text = scenario(entities=two, init=init, stories=story(maneuver(speed("1")), actors="cars"))
    found = read(text.encode())
    (actors,) = [one for one in walk(found) if isinstance(one, osc.Actors)]
    assert [ref.entity_ref for ref in actors.entity_refs] == ["ego", "other"]
    privates = found.storyboard.init.actions.privates
    assert [one.entity_ref for one in privates] == ["other", "ego"]
    assert found.entities.entity_selections == ()


def test_a_file_that_stands_by_itself_stays_as_it_is(s4):
    """Also with a folder, and parameters that are texts."""
    assert to_xml(read(s4)) == s4


def test_a_trailer_whose_name_is_left_empty_is_none():
    """So catalogues for several tools have it: a parameter that may name a trailer."""
    pulls = "<Trailer><TrailerRef entityRef='$pulls'/></Trailer></Vehicle>"
    for name, expected in (("", None), ("other", "other")):
        body = car(declared=declared(parameter("pulls", "string", name)))
        text = scenario(entities=entity(body.replace("</Vehicle>", pulls)))
        trailer = read(text.encode()).entities.scenario_objects[0].entity_object.trailer
        assert (trailer and trailer.trailer.entity_ref) == expected
