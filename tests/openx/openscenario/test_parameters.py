import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.read import read


def declare(s4: bytes, *declarations: str) -> bytes:
    text = "".join(declarations).encode()
    return s4.replace(b"</ParameterDeclarations>", text + b"</ParameterDeclarations>", 1)


def one(name: str, kind: str, value: str, constraints: str = "") -> str:
    return (
        f'<ParameterDeclaration name="{name}" parameterType="{kind}" value="{value}">'
        f"{constraints}</ParameterDeclaration>"
    )


def group(*constraints: tuple[str, str]) -> str:
    inner = "".join(f'<ValueConstraint rule="{r}" value="{v}"/>' for r, v in constraints)
    return f"<ConstraintGroup>{inner}</ConstraintGroup>"


def test_values_by_their_types(s4):
    scenario = read(
        declare(
            s4,
            one("an_integer", "integer", "3"),
            one("a_boolean", "boolean", "true"),
            one("a_text", "string", "1.0"),
        )
    )
    values = parameters.values(scenario)
    assert values["an_integer"] == 3
    assert isinstance(values["an_integer"], int)
    assert values["a_boolean"] is True
    assert values["a_text"] == "1.0"
    assert values["bv_speed"] == 2.05
    assert list(values)[:2] == ["bv_speed", "bv_start"]
    numbers = parameters.numbers(scenario)
    assert numbers["an_integer"] == 3.0
    assert not {"a_boolean", "a_text", "time_of_day"} & numbers.keys()


@pytest.mark.parametrize(
    ("declaration", "text"),
    [
        (
            one("bv_speed", "double", "1.0"),
            "parameter bv_speed is declared twice, as 2.05 and as 1.0",
        ),
        (one("a b", "double", "1.0"), "a parameter's name must be an identifier, got 'a b'"),
        (one("d", "double", "fast"), "the value of parameter d must be of type double, got 'fast'"),
        (one("d", "integer", "1.5"), "must be of type int, got '1.5'"),
        (one("d", "unsignedShort", "-1"), "must be of type unsignedShort"),
        (one("d", "dateTime", "today"), "must be of type dateTime"),
    ],
)
def test_bad_declarations(s4, declaration, text):
    with pytest.raises(FileFormatError) as caught:
        read(declare(s4, declaration))
    assert text in str(caught.value)
    assert "(line " in str(caught.value)


@pytest.mark.parametrize(
    ("constraints", "holds"),
    [
        (group(("greaterThan", "2")), True),
        (group(("greaterThan", "3")), False),
        (group(("greaterOrEqual", "3"), ("lessOrEqual", "3")), True),
        (group(("lessThan", "3")), False),
        (group(("equalTo", "3.0")), True),
        (group(("notEqualTo", "3.0")), False),
        (group(("lessThan", "2")) + group(("greaterThan", "2")), True),
        (group(("lessThan", "2")) + group(("greaterThan", "4")), False),
        (group(("greaterThan", "2"), ("lessThan", "2.5")), False),
        # rounding of a value that passed through another tool
        (group(("greaterOrEqual", "3.00001")), True),
        (group(("greaterOrEqual", "3.01")), False),
        (group(("greaterThan", "3.0000000000000001")), False),
    ],
)
def test_constraints_groups_are_alternatives(s4, constraints, holds):
    data = declare(s4, one("d", "double", "3.0", constraints))
    if holds:
        read(data)
    else:
        with refuses(FileFormatError):
            read(data)


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ("$w", None),
        ("${$w - 1}", None),
        ("${$later / 3}", None),  # declared after it, and made of another
        ("${$w - 3}", "parameter d must be lessThan ${$w - 3} = 2.0, got 3.0"),
        ("$nothing", "has a constraint that refers to $nothing, which is not declared"),
        ("${$word + 1}", "has a constraint that computes with $word, which is no number"),
        ("${1 / 0}", "has a constraint that must be finite"),
        ("${1 +}", "has a constraint that"),
    ],
)
def test_a_constraint_may_refer_to_other_parameters(s4, limit, said):
    declared = (
        one("d", "double", "3.0", group(("lessThan", limit))),
        one("w", "double", "5"),
        one("word", "string", "end"),
        one("later", "double", "${$w * 4}"),
    )
    if said is None:
        read(declare(s4, *declared))
        return
    with pytest.raises(FileFormatError) as caught:
        read(declare(s4, *declared))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "value", "constraint", "text"),
    [
        ("string", "a", ("lessThan", "b"), "which string does not know"),
        ("string", "a", ("equalTo", "b"), "must be equalTo b, got a"),
        ("double", "1.0", ("lessThan", "b"), "has a constraint that must be of type double"),
    ],
)
def test_constraints_that_do_not_fit(s4, kind, value, constraint, text):
    with pytest.raises(FileFormatError) as caught:
        read(declare(s4, one("d", kind, value, group(constraint))))
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("declaration", "text"),
    [
        (one("d", "$other", "1.0"), "ParameterDeclaration"),
    ],
)
def test_declarations_refer_to_parameters_in_values_and_limits_only(s4, declaration, text):
    with refuses(UnsupportedError, text):
        read(declare(s4, declaration))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (b'"$bv_speed"', b'"$bv_sped"', "refers to $bv_sped, which is not declared"),
        (b"pow(200,($fog_density)", b"pow(200,($fog)", "refers to $fog, which is not declared"),
        (b'"$bv_speed"', b'"$time_of_day"', "must be of type double, $time_of_day is a string"),
        (b'"$bv_speed"', b'"$yes"', "must be of type double, $yes is a boolean"),
        (b'animation="false"', b'animation="$bv_speed"', "must be of type boolean"),
        (b"pow(200,($fog_density)", b"pow(200,($yes)", "takes a boolean of $yes for arithmetic"),
        (b'"$time_of_day"', b'"$road_wetness"', "must be of type dateTime"),
        (b'wetness="$road_wetness"', b'wetness="$time_of_day"', "must be one of dry, moist"),
        (b'wetness="$road_wetness"', b'wetness="$bv_speed"', "must be a string parameter"),
        (b'maximumExecutionCount="1"', b'maximumExecutionCount="$bv_speed"',
         "must be of type unsignedInt, $bv_speed is a double"),
    ],
)  # fmt: skip
def test_references_must_fit(s4, old, new, text):
    data = declare(s4, one("yes", "boolean", "true"))
    assert old in data
    with pytest.raises(FileFormatError) as caught:
        read(data.replace(old, new, 1))
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"$bv_speed"', b'"$count"'),  # a whole number for a double
        (b'maximumExecutionCount="1"', b'maximumExecutionCount="$count"'),
        (b'animation="false"', b'animation="$yes"'),
        (b'name="ego_driver"', b'name="$bv_speed"'),  # anything for a text
        (b'"$time_of_day"', b'"$noon"'),
    ],
)
def test_references_that_fit(s4, old, new):
    data = declare(
        s4,
        one("yes", "boolean", "true"),
        one("count", "unsignedInt", "2"),
        one("noon", "dateTime", "2020-01-01T12:00:00"),
    )
    assert old in data
    read(data.replace(old, new, 1))


def judged(s4: bytes, name: str, parameter: str) -> bytes:
    """The file with another condition in its stop trigger."""
    condition = (
        f'<ConditionGroup><Condition name="{name}" delay="0" conditionEdge="rising">'
        f'<ByValueCondition><ParameterCondition parameterRef="{parameter}" value="" '
        'rule="lessThan"/></ByValueCondition></Condition></ConditionGroup></StopTrigger>'
    )
    before, after = s4.rsplit(b"</StopTrigger>", 1)
    return before + condition.encode() + after


@pytest.mark.parametrize("parameter", ["", "distance_success"])
def test_scenario_runner_s_criteria_need_no_parameter(s4, parameter):
    assert not parameters.problems(read(judged(s4, "criteria_DrivenDistanceTest", parameter)))
    with refuses(FileFormatError, parameter):
        read(judged(s4, "arrives", parameter))
