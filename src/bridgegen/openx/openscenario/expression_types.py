"""Whether an expression is a number or a boolean, and whether it makes sense.

Source: ASAM OpenSCENARIO XML 1.3, section 9.2.1: arithmetic takes and gives numbers; ``not``,
``and`` and ``or`` take and give booleans; nothing turns one into the other.
"""

import ast
from collections.abc import Mapping

from bridgegen.openx.openscenario.values import Expr, Kind


def problem(expression: Expr, is_boolean: Mapping[str, bool], want: Kind) -> str | None:
    """Return what is wrong with the types in an expression, or None.

    Args:
        expression: whose parameters are all known.
        is_boolean: of each parameter, whether it is a boolean; else it is a number.
        want: the type that it is needed as; a text is content with both.
    """
    try:
        truth = _is_truth(expression.expression.tree, is_boolean)
    except _MixedError as error:
        return str(error)
    if want is Kind.BOOLEAN and not truth:
        return f"must be a boolean, {expression} is a number"
    if want.is_number and truth:
        return f"must be of type {want.value}, {expression} is a boolean"
    return None


class _MixedError(Exception):
    """A boolean where a number is needed, or the other way round."""


def _is_truth(node: ast.expr, is_boolean: Mapping[str, bool]) -> bool:
    match node:
        case ast.Name(id=name):
            return is_boolean[name]
        case ast.Compare():  # true and false
            return True
        case ast.BoolOp(values=operands):
            return _all(operands, is_boolean, truth=True)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return _all([operand], is_boolean, truth=True)
        case ast.UnaryOp(operand=operand):
            return _all([operand], is_boolean, truth=False)
        case ast.BinOp(left=left, right=right):
            return _all([left, right], is_boolean, truth=False)
        case ast.Call(args=arguments):
            return _all(arguments, is_boolean, truth=False)
    return False


def _all(nodes: list[ast.expr], is_boolean: Mapping[str, bool], *, truth: bool) -> bool:
    for node in nodes:
        if _is_truth(node, is_boolean) is not truth:
            names = sorted(one.id for one in ast.walk(node) if isinstance(one, ast.Name))
            of = f" of ${', $'.join(names)}" if names else ""
            what = ("not, and, or", "number") if truth else ("arithmetic", "boolean")
            raise _MixedError(f"takes a {what[1]}{of} for {what[0]}")
    return truth
