"""Formulas of constraints as portable SPARQL 1.1, which has no roots, powers, logs or angles.

Those are computed as on paper: the argument is brought into a small interval, where a polynomial
(or Newton's steps) gives the value, to about 12 digits: far below `odd.parameters.TOLERANCE`. Every
intermediate result has a variable of its own (``BIND``), so nothing is computed twice.

Where NumPy gives NaN (the root of a negative number, 0/0) the result is left unbound; a filter
that asks ``COALESCE(…, false)`` then takes the rule as broken, as the check of rows does.
"""

import ast
import math

from bridgegen.scenario.language.expression import Expression

UNDEFINED = "?undefined"
"""Variable that is never bound: using it is SPARQL's error, the counterpart of NaN."""

_ARITHMETIC: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
}
_COMPARE: dict[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "=",
    ast.NotEq: "!=",
}
_LN2 = math.log(2.0)
_LARGEST_POWER = 64
_BITS = (512, 256, 128, 64, 32, 16, 8, 4, 2, 1)
"""Binary digits of the exponent of 2 that a double can have, as numbers."""
_NATIVE = {"abs": "ABS", "ceil": "CEIL", "floor": "FLOOR", "round": "ROUND"}


def variable(name: str) -> str:
    """Return the variable that holds a parameter's value.

    Letters on both sides keep a parameter called ``values`` or ``minus`` from being taken for the
    keyword by pyshacl, which looks for those by regular expressions.
    """
    return f"?x_{name}_x"


def literal(value: float) -> str:
    """Return a number as an ``xsd:double`` in SPARQL's spelling."""
    if not math.isfinite(value):
        text = "NaN" if math.isnan(value) else "INF" if value > 0 else "-INF"
        return f'"{text}"^^<http://www.w3.org/2001/XMLSchema#double>'
    text = repr(float(value))
    # Without an exponent SPARQL reads a decimal, whose arithmetic is not that of doubles.
    text = text if "e" in text else text + "e0"
    return f"({text})" if text.startswith("-") else text


def binds(expression: Expression, result: str) -> str:
    """Return ``BIND`` clauses that leave a formula's value in a variable.

    Args:
        expression: its parameters' values are expected as ``xsd:double`` in `variable`.
        result: the variable, without ``?``; also the prefix of all intermediate ones.
    """
    compiler = _Compiler(result)
    compiler.bind_as(f"?{result}", compiler.number(expression.tree))
    return " ".join(compiler.lines)


class _Compiler:
    def __init__(self, prefix: str) -> None:
        self.prefix = prefix
        self.lines: list[str] = []

    def bind(self, text: str) -> str:
        """Give an intermediate result a variable."""
        name = f"?{self.prefix}_{len(self.lines)}"
        self.bind_as(name, text)
        return name

    def bind_as(self, name: str, text: str) -> None:
        self.lines.append(f"BIND({text} AS {name})")

    # -- the formula's own syntax --------------------------------------------------------------

    def number(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(value=float() as value):
                return literal(value)
            case ast.Name(id=name):
                return variable(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.number(operand)})"
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return self.quotient(self.number(left), self.number(right))
            # SPARQL has no remainder. This one has the sign of the divisor, as NumPy's, which the
            # decoder uses.
            case ast.BinOp(left=left, op=ast.Mod(), right=right):
                a, b = self.bind(self.number(left)), self.bind(self.number(right))
                whole = self.bind(f"FLOOR({self.quotient(a, b)})")
                return f"IF({b} = 0.0e0, {UNDEFINED}, {a} - {b} * {whole})"
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self.power(self.number(left), right)
            case ast.BinOp(left=left, op=op, right=right):
                return f"({self.number(left)} {_ARITHMETIC[type(op)]} {self.number(right)})"
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return f"IF({self.truth(test)}, {self.number(body)}, {self.number(orelse)})"
            case ast.Subscript(value=ast.Tuple(elts=values), slice=ast.Name(id=index)):
                return self.taken(variable(index), [self.number(value) for value in values])
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self.call(name, [self.number(argument) for argument in arguments])
        return f"IF({self.truth(node)}, 1.0e0, 0.0e0)"

    def truth(self, node: ast.expr) -> str:
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                compared = f"{self.number(left)} {_COMPARE[type(op)]} {self.number(right)}"
                # as in NumPy: what is undefined differs from everything, and else compares false
                return f"COALESCE({compared}, {str(isinstance(op, ast.NotEq)).lower()})"
            case ast.BoolOp(op=op, values=values):
                word = " && " if isinstance(op, ast.And) else " || "
                return "(" + word.join(self.truth(value) for value in values) + ")"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.truth(operand)})"
        return f"COALESCE({self.number(node)} != 0.0e0, true)"

    def call(self, name: str, arguments: list[str]) -> str:
        if name in _NATIVE:
            return f"{_NATIVE[name]}({arguments[0]})"
        if name in ("min", "max"):
            best = self.bind(arguments[0])
            for argument in arguments[1:]:
                other = self.bind(argument)
                best = self.bind(f"IF({other} {'<>'[name == 'max']} {best}, {other}, {best})")
            return best
        x = self.bind(arguments[0])
        if name == "sign":
            return f"IF({x} > 0.0e0, 1.0e0, IF({x} < 0.0e0, -1.0e0, 0.0e0))"
        function = {
            "sqrt": self.sqrt,
            "exp": self.exp,
            "log": self.log,
            "sin": self.sin,
            "cos": self.cos,
            "tan": self.tan,
            "asin": self.asin,
            "acos": self.acos,
            "atan": self.atan,
        }[name]
        return function(x)

    def taken(self, index: str, values: list[str]) -> str:
        """Return the value of a `Lookup` at an index from 0."""
        found = UNDEFINED
        for first in range(0, len(values), 4):  # a few at a time, as in ``polynomial``
            for k in range(first, min(first + 4, len(values))):
                found = f"IF({index} = {literal(float(k))}, {values[k]}, {found})"
            found = self.bind(found)
        return found

    # -- what SPARQL lacks; x, a and b are variables -------------------------------------------

    def polynomial(self, x: str, coefficients: list[float]) -> str:
        """Return the value at x, lowest coefficient first, by Horner's rule."""
        value = literal(coefficients[-1])
        rest = coefficients[:-1]
        while rest:
            # a few steps at a time: a deep nest is too much for some parsers of SPARQL
            rest, few = rest[:-4], rest[-4:]
            for coefficient in reversed(few):
                value = f"({literal(coefficient)} + {x} * {value})"
            value = self.bind(value)
        return value

    def quotient(self, left: str, right: str) -> str:
        """Divide; 0/0 is undefined, as NaN would slip through ``IF``."""
        a, b = self.bind(left), self.bind(right)
        return f"IF({a} = 0.0e0 && {b} = 0.0e0, {UNDEFINED}, {a} / {b})"

    def scaled(self, x: str, bits: tuple[int, ...], unit: float) -> tuple[str, str]:
        """Write x > 0 as m·unit^k with m in [1, unit).

        Returns:
            the variables of m and k.
        """
        m, k = x, literal(0.0)
        for bit in bits:
            big, m0, k0 = literal(unit**bit), m, k
            m = self.bind(f"IF({m0} >= {big}, {m0} / {big}, {m0})")
            k = self.bind(f"IF({m0} >= {big}, {k0} + {literal(bit)}, {k0})")
        for bit in bits:
            # m < 1 only where x was: multiplied as long as that keeps it below unit
            small, m0, k0 = literal(unit ** (1 - bit)), m, k
            big = literal(unit**bit)
            m = self.bind(f"IF({m0} < {small}, {m0} * {big}, {m0})")
            k = self.bind(f"IF({m0} < {small}, {k0} - {literal(bit)}, {k0})")
        return m, k

    def two_to(self, k: str, bits: tuple[int, ...] = _BITS) -> str:
        """Return 2^k for a whole number k whose size the bits can hold."""
        rest, result = self.bind(f"ABS({k})"), literal(1.0)
        for bit in bits:
            previous = rest
            result = self.bind(
                f"IF({previous} >= {literal(bit)}, {result} * {literal(2.0**bit)}, {result})"
            )
            rest = self.bind(
                f"IF({previous} >= {literal(bit)}, {previous} - {literal(bit)}, {previous})"
            )
        return f"IF({k} < 0.0e0, 1.0e0 / {result}, {result})"

    def sqrt(self, x: str, bits: tuple[int, ...] = _BITS[1:]) -> str:
        m, k = self.scaled(x, bits, 4.0)
        y = self.bind(f"0.5e0 + 0.5e0 * {m}")
        for _ in range(5):  # Newton; from 25 % off at most
            y = self.bind(f"0.5e0 * ({y} + {m} / {y})")
        root = self.bind(f"{y} * {self.two_to(k, bits)}")
        return f"IF({x} = 0.0e0, 0.0e0, IF({x} > 0.0e0, {root}, {UNDEFINED}))"

    def exp(self, x: str) -> str:
        k = self.bind(f"FLOOR({x} * {literal(1.0 / _LN2)} + 0.5e0)")
        r = self.bind(f"{x} - {k} * {literal(_LN2)}")
        series = self.polynomial(r, [1.0 / math.factorial(n) for n in range(14)])
        value = self.bind(f"{series} * {self.two_to(k)}")
        highest = literal(709.0)
        lowest = literal(-708.0)
        infinite = literal(math.inf)
        return f"IF({x} > {highest}, {infinite}, IF({x} < {lowest}, 0.0e0, {value}))"

    def log(self, x: str) -> str:
        m, k = self.scaled(x, _BITS, 2.0)
        s = self.bind(f"({m} - 1.0e0) / ({m} + 1.0e0)")  # in [0, 1/3)
        square = self.bind(f"{s} * {s}")
        series = self.polynomial(square, [2.0 / (2 * n + 1) for n in range(16)])
        value = self.bind(f"{s} * {series} + {k} * {literal(_LN2)}")
        least = literal(-math.inf)
        return f"IF({x} = 0.0e0, {least}, IF({x} > 0.0e0, {value}, {UNDEFINED}))"

    def sin(self, x: str) -> str:
        turn = literal(2.0 * math.pi)
        quarter = literal(0.5 * math.pi)
        half = literal(math.pi)
        r = self.bind(f"{x} - {turn} * FLOOR({x} / {turn} + 0.5e0)")
        r = self.bind(
            f"IF({r} > {quarter}, {half} - {r}, IF({r} < -{quarter}, -{half} - {r}, {r}))"
        )
        square = self.bind(f"{r} * {r}")
        terms = [(-1.0) ** n / math.factorial(2 * n + 1) for n in range(11)]
        return f"({r} * {self.polynomial(square, terms)})"

    def cos(self, x: str) -> str:
        return self.sin(self.bind(f"{x} + {literal(0.5 * math.pi)}"))

    def asin(self, x: str) -> str:
        size = self.bind(f"ABS({x})")
        large = f"{size} > 0.5e0"
        # asin x = π/2 − 2·asin √((1−x)/2) leaves [0, 1/2] to the series
        root = self.sqrt(self.bind(f"0.5e0 - 0.5e0 * {size}"), _BITS[5:])
        z = self.bind(f"IF({large}, {root}, {size})")
        square = self.bind(f"{z} * {z}")
        terms = [math.comb(2 * n, n) / 4.0**n / (2 * n + 1) for n in range(24)]
        small = self.bind(f"{z} * {self.polynomial(square, terms)}")
        angle = self.bind(f"IF({large}, {literal(0.5 * math.pi)} - 2.0e0 * {small}, {small})")
        return f"IF({size} > 1.0e0, {UNDEFINED}, IF({x} < 0.0e0, -{angle}, {angle}))"

    def tan(self, x: str) -> str:
        return f"({self.sin(x)} / {self.cos(x)})"

    def acos(self, x: str) -> str:
        return f"({literal(0.5 * math.pi)} - {self.asin(x)})"

    def atan(self, x: str) -> str:
        # with the tangent of half the angle, at most 1, asin is far from its steep end
        near = self.bind(f"IF(ABS({x}) > 1.0e8, 0.0e0, {x})")
        root = self.sqrt(self.bind(f"1.0e0 + {near} * {near}"))
        half = self.bind(f"{near} / (1.0e0 + {root})")
        root = self.sqrt(self.bind(f"1.0e0 + {half} * {half}"))
        angle = self.bind(f"2.0e0 * {self.asin(self.bind(f'{half} / {root}'))}")
        far = f"{literal(0.5 * math.pi)} - 1.0e0 / ABS({x})"
        far = f"IF({x} < 0.0e0, -({far}), {far})"
        return f"IF(ABS({x}) > 1.0e8, {far}, {angle})"

    def power(self, base: str, exponent: ast.expr) -> str:
        a = self.bind(base)
        match exponent:
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=float() as value)):
                value = -value
            case ast.Constant(value=float() as value):
                pass
            case _:
                value = math.nan
        if abs(value) <= _LARGEST_POWER and value == int(value):
            whole = self.whole_power(a, abs(int(value)))
            return whole if value >= 0 else f"(1.0e0 / {whole})"
        if value == 0.5:
            return self.sqrt(a)
        b = self.bind(self.number(exponent))
        size = self.bind(f"ABS({a})")
        positive = self.bind(self.exp(self.bind(f"{b} * {self.log(size)}")))
        even = f"FLOOR({b} * 0.5e0) * 2.0e0 = {b}"
        negative = f"IF(FLOOR({b}) != {b}, {UNDEFINED}, IF({even}, {positive}, -{positive}))"
        at_zero = f"IF({b} > 0.0e0, 0.0e0, {literal(math.inf)})"
        return (
            f"IF({b} = 0.0e0, 1.0e0, "
            f"IF({a} > 0.0e0, {positive}, IF({a} < 0.0e0, {negative}, {at_zero})))"
        )

    def whole_power(self, a: str, exponent: int) -> str:
        """Multiply, squaring on the way."""
        result, square = literal(1.0), a
        while exponent:
            if exponent % 2:
                result = self.bind(f"{result} * {square}")
            exponent //= 2
            if exponent:
                square = self.bind(f"{square} * {square}")
        return result
