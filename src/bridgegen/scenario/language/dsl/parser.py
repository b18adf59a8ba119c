"""From the text of an OpenSCENARIO DSL file to its declarations: tokens by indentation, then nodes.

Source: ASAM OpenSCENARIO DSL 2.1, 7.2 (lexical rules) and 7.3 (grammar). Whatever is not of the
grammar is refused at its line; size, tokens and depth are bounded.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, NamedTuple

from bridgegen.base.errors import FileFormatError

MAX_BYTES = 2**20
MAX_DEPTH = 32
TYPES = ("struct", "actor", "scenario", "action", "modifier")
COMPOSITIONS = ("serial", "parallel", "one_of")

_TOKEN = re.compile(
    r"""(?P<space>[ \t\r\f]+|\\[ \t]*\r?\n|\#[^\n]*|/\*(?s:.*?)\*/)
    |(?P<open>/\*)
    |(?P<newline>\n)
    |(?P<text>\"{3}(?s:.*?)\"{3}|'{3}(?s:.*?)'{3}|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')
    |(?P<number>0x[0-9A-Fa-f]+|[0-9]*\.[0-9]+(?:[eE][-+]?[0-9]+)?|[0-9]+(?:[eE][-+]?[0-9]+)?)
    |(?P<name>[A-Za-z_][A-Za-z0-9_]*|\|[^|\n]+\|)
    |(?P<sign>->|=>|==|!=|<=|>=|\.\.|[-+*/%<>=()\[\],:.!?@])""",
    re.VERBOSE,
)
_WORDS = {"in", "and", "or", "not", "is", "if", "as", "with", "of"}
"""Words that no unit is called."""
_LEVELS: tuple[tuple[str, ...], ...] = (
    ("=>",), ("or",), ("and",), ("==", "!=", "<", "<=", ">", ">=", "in"), ("+", "-"),
    ("*", "/", "%"),
)  # fmt: skip
_RELATION = 3


class Token(NamedTuple):
    """A word of the text: its kind (name, number, text, sign, line, in, out, end), and its line."""

    kind: str
    text: str
    line: int


@dataclass(frozen=True)
class Node:
    """A piece of a file.

    Attributes:
        kind: ``field``, ``do``, ``call``, ``number``, …
        line: in its file.
        file: as messages name it.
        name: what it declares or names; an operator.
        items: its parts, by what its kind is.
        more: named parts: arguments, a type, a value, members.
    """

    kind: str
    line: int
    file: str
    name: str
    items: "tuple[Node, ...]"
    more: dict[str, Any]

    @property
    def place(self) -> str:
        """File and line, for messages."""
        return f"{self.file}, line {self.line}"

    @property
    def source(self) -> str:
        """The file's name and the line, for a scenario's sources."""
        return f"{PurePath(self.file).name}, line {self.line}."

    def part(self, key: str) -> "tuple[Node, ...]":
        """Return the members under a key; none if it has none."""
        return tuple(self.more.get(key) or ())

    def every(self) -> "Iterator[Node]":
        """Yield this and all nodes in it."""
        yield self
        for value in (*self.items, *self.more.values()):
            for each in value if isinstance(value, tuple | list) else (value,):
                if isinstance(each, Node):
                    yield from each.every()


def tokens_of(text: str, place: str) -> list[Token]:
    """Return the tokens of a text, with what begins and ends a block.

    Raises:
        FileFormatError: a character or an indentation that is not of the language.
    """
    found: list[Token] = []
    indents, opened, line, at, begins = [0], 0, 1, 0, True
    text += "\n"
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None or match.lastgroup == "open":
            is_open = match is not None or text[at] in "\"'"
            what = "a text or comment does not end" if is_open else f"unexpected {text[at]!r}"
            raise FileFormatError(f"not OpenSCENARIO DSL: {what} ({place}, line {line})")
        kind, word, start = str(match.lastgroup), match[0], at
        at = match.end()
        if kind == "newline" and not opened and not begins:
            found.append(Token("line", "", line))
            begins = True
        elif kind not in ("space", "newline"):
            if begins and not opened:
                margin = text[text.rfind("\n", 0, start) + 1 : start].expandtabs(8)
                width = len(margin)
                if width > indents[-1]:
                    indents.append(width)
                    found.append(Token("in", "", line))
                while width < indents[-1]:
                    indents.pop()
                    found.append(Token("out", "", line))
                if width != indents[-1] or len(indents) > MAX_DEPTH:
                    why = f"blocks nest {MAX_DEPTH} deep at most"
                    why = why if width == indents[-1] else "no block begins at this indentation"
                    raise FileFormatError(f"not OpenSCENARIO DSL: {why} ({place}, line {line})")
            begins = False
            if kind == "sign":
                opened = max(0, opened + (word in "([") - (word in ")]"))
            if kind == "name":
                word = word.strip("|")
            found.append(Token(kind, word, line))
        line += match[0].count("\n")
    found += [Token("out", "", line)] * (len(indents) - 1)
    return [*found, Token("end", "", line)]


def parse(data: bytes, place: str) -> tuple[Node, ...]:
    """Return the imports and declarations of a file.

    Args:
        data: UTF-8.
        place: the file, for messages.

    Raises:
        FileFormatError: too large, or not of the grammar, with the line.
    """
    if len(data) > MAX_BYTES:
        raise FileFormatError(f"a file may have {MAX_BYTES} bytes at most ({place})")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"not UTF-8 at byte {error.start} ({place})") from None
    return tuple(_Parser(tokens_of(text, place), place).file())


class _Parser:
    def __init__(self, tokens: list[Token], place: str) -> None:
        self._tokens, self._place, self._at, self._depth = tokens, place, 0, 0

    # -- tokens ------------------------------------------------------------------------------------

    @property
    def _next(self) -> Token:
        return self._tokens[self._at]

    def _sees(self, *texts: str, ahead: int = 0) -> bool:
        token = self._tokens[min(self._at + ahead, len(self._tokens) - 1)]
        return token.kind in ("sign", "name") and token.text in texts

    def _take(self, *texts: str) -> bool:
        if seen := self._sees(*texts):
            self._at += 1
        return seen

    def _need(self, *texts: str) -> Token:
        if not self._sees(*texts):
            self._refuse(" or ".join(f"'{text}'" for text in texts))
        self._at += 1
        return self._tokens[self._at - 1]

    def _kind(self, kind: str, what: str) -> Token:
        if self._next.kind != kind:
            self._refuse(what)
        self._at += 1
        return self._tokens[self._at - 1]

    def _name(self) -> str:
        return self._kind("name", "a name").text

    def _refuse(self, wanted: str) -> None:
        kind, text, line = self._next
        names = {"line": "the end of the line", "in": "an indentation", "out": "the block's end"}
        got = f"'{text[:40]}'" if text else names.get(kind, "the file's end")
        what = f"{wanted} is needed, got {got}"
        raise FileFormatError(f"not OpenSCENARIO DSL: {what} ({self._place}, line {line})")

    def _node(self, kind: str, line: int, name: str = "", *items: Node, **more: Any) -> Node:
        return Node(kind, line, self._place, name, items, more)

    # -- declarations ------------------------------------------------------------------------------

    def file(self) -> Iterator[Node]:
        """Yield what stands on the first level."""
        while self._next.kind != "end":
            line = self._next.line
            if self._take("import"):
                if self._next.kind == "text":
                    name = self._text(self._kind("text", "a text").text)
                else:
                    name = self._dotted()
                self._kind("line", "a new line")
                yield self._node("import", line, name)
            elif self._take("type", "unit"):
                yield self._physical(line, self._tokens[self._at - 1].text)
            elif self._take("enum"):
                name = self._name()
                self._need(":")
                yield self._enum(line, "enum", name)
            elif self._take("global"):
                yield self._field(line, "global")
            elif self._sees(*TYPES):
                yield self._type(line, self._name())
            elif self._take("extend"):
                name = self._dotted()
                self._need(":")
                if self._sees("["):
                    yield self._enum(line, "extend", name)
                else:
                    members = self._block(self._member)
                    yield self._node("extend", line, name, members=members)
            else:
                self._refuse("a declaration (import, type, unit, enum, actor, scenario, …)")

    def _dotted(self) -> str:
        name = self._name()
        while self._take("."):
            name += f".{self._name()}"
        return name

    def _type_name(self) -> str:
        listed = "list of " if self._take("list") and self._need("of") else ""
        return listed + self._dotted()

    def _physical(self, line: int, kind: str) -> Node:
        name, of = self._name(), ""
        if kind == "unit":
            self._need("of")
            of = self._name()
        self._need("is")
        self._need("SI")
        parts = self._arguments()
        self._kind("line", "a new line")
        return self._node(kind, line, name, of=of, parts=parts)

    def _enum(self, line: int, kind: str, name: str) -> Node:
        self._need("[")
        members: list[Node] = []
        while not members or self._take(","):
            at = self._next.line
            member = self._name()
            value = None
            if self._take("="):
                text = self._kind("number", "a whole number").text
                if not re.fullmatch(r"[0-9]{1,9}|0x[0-9A-Fa-f]{1,8}", text):
                    self._at -= 1
                    self._refuse("a whole number below 1e9")
                value = int(text, 16 if "x" in text else 10)
            members.append(self._node("member", at, member, value=value))
        self._need("]")
        self._kind("line", "a new line")
        return self._node(kind, line, name, members=tuple(members), values=True)

    def _type(self, line: int, kind: str) -> Node:
        name, base, of = self._dotted(), "", ""
        if self._take("inherits"):
            base = self._dotted()
        elif kind == "modifier" and self._take("of"):
            of = self._dotted()
        condition = self._arguments() if self._sees("(") else ()
        members = self._block(self._member) if self._take(":") else self._end()
        more = {"base": base, "of": of, "condition": condition, "members": members}
        return self._node(kind, line, name, **more)

    def _end(self) -> tuple[Node, ...]:
        self._kind("line", "a new line")
        return ()

    def _block(self, member: Callable[[], Node]) -> tuple[Node, ...]:
        self._kind("line", "a new line")
        self._kind("in", "an indented block")
        found = [member()]
        while self._next.kind != "out":
            found.append(member())
        self._at += 1
        return tuple(found)

    def _with(self) -> tuple[Node, ...]:
        if self._take("with"):
            self._need(":")
            return self._block(self._member)
        return self._end()

    def _field(self, line: int, kind: str) -> Node:
        names = [self._name()]
        while self._take(","):
            names.append(self._name())
        self._need(":")
        of = self._type_name()
        value = self._expression() if self._take("=") else None
        more = {"names": names, "of": of, "value": value, "members": self._with()}
        return self._node(kind, line, names[0], **more)

    def _member(self) -> Node:
        line = self._next.line
        if self._take("event"):
            name = self._name()
            arguments = self._declared() if self._sees("(") else ()
            happens = self._happening() if self._take("is") else None
            self._end()
            return self._node("event", line, name, arguments=arguments, happens=happens)
        if self._take("var"):
            return self._field(line, "var")
        if self._take("def"):
            return self._method(line)
        if self._take("do"):
            return self._node("do", line, "", self._doing())
        if self._take("on"):
            happens = self._happening()
            self._need(":")
            return self._node("on", line, "", happens, members=self._block(self._doing))
        if self._take("until"):
            happens = self._happening()
            self._end()
            return self._node("until", line, "", happens)
        if self._sees("keep", "remove_default") and self._sees("(", ahead=1):
            kind = self._name()
            self._need("(")
            strength = self._name() if self._sees("default", "hard") else ""
            expression = self._expression()
            self._need(")")
            self._end()
            return self._node(kind, line, strength, expression)
        if self._sees(",", ":", ahead=1):
            return self._field(line, "field")
        call = self._postfix()
        if call.kind != "call":
            self._refuse("'('")
        self._end()
        return call

    def _method(self, line: int) -> Node:
        name, arguments = self._name(), self._declared()
        if self._take("->"):
            self._type_name()
        self._need("is")
        self._take("only")
        if self._need("expression", "undefined", "external").text != "undefined":
            self._expression()  # or what is called, with its arguments
        self._end()
        return self._node("def", line, name, arguments=arguments)

    def _declared(self) -> tuple[Node, ...]:
        found: list[Node] = []
        self._need("(")
        while not self._take(")"):
            if found:
                self._need(",")
            line, name = self._next.line, self._name()
            self._need(":")
            of = self._type_name()
            value = self._expression() if self._take("=") else None
            found.append(self._node("argument", line, name, of=of, value=value))
        return tuple(found)

    def _happening(self) -> Node:
        """Read when something happens: ``@event [as name] [if condition]``, or a condition."""
        line = self._next.line
        if not self._take("@"):
            return self._expression()
        event = self._postfix()
        name = self._name() if self._take("as") else ""
        condition = self._expression() if self._take("if") else None
        return self._node("at", line, name, event, condition=condition)

    def _doing(self) -> Node:
        line, label = self._next.line, ""
        if not self._sees(*COMPOSITIONS) and self._sees(":", ahead=1):
            label = self._name()
            self._need(":")
        if self._sees(*COMPOSITIONS):
            kind = self._name()
            arguments = self._arguments() if self._sees("(") else ()
            self._need(":")
            members = self._block(self._doing)
            given = self._with() if self._sees("with") else ()
            more = {"arguments": arguments, "members": members, "given": given}
            return self._node(kind, line, label, **more)
        if self._take("wait"):
            happens = self._happening()
            self._end()
            return self._node("wait", line, label, happens)
        kind = self._name() if self._sees("emit", "call") else "drive"
        call = self._postfix()
        if kind == "emit":
            self._end()
            return self._node(kind, line, label, call)
        if call.kind != "call":
            self._refuse("'('")
        given = self._with()
        return self._node(kind, line, label, call, given=given)

    # -- expressions -------------------------------------------------------------------------------

    def _expression(self, level: int = 0) -> Node:
        self._depth += 1
        if self._depth > 8 * MAX_DEPTH:
            self._refuse(f"an expression that nests {MAX_DEPTH} deep at most")
        line = self._next.line
        if level == _RELATION and self._take("not"):
            found = self._node("operation", line, "not", self._expression(level))
        elif level == len(_LEVELS):
            found = self._factor()
        else:
            found = self._expression(level + 1)
            chain = 0
            while self._sees(*_LEVELS[level]):
                chain = self._longer(chain)
                sign = self._name_or_sign()
                right = self._expression(level + 1)
                found = self._node("operation", line, sign, found, right)
            if level == 0 and self._take("?"):
                yes = self._expression()
                self._need(":")
                found = self._node("choice", line, "", found, yes, self._expression())
        self._depth -= 1
        return found

    def _longer(self, chain: int) -> int:
        if chain >= 8 * MAX_DEPTH:  # what reads it goes as deep as it is long
            self._refuse(f"a chain of {8 * MAX_DEPTH} values at most")
        return chain + 1

    def _name_or_sign(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1].text

    def _factor(self) -> Node:
        line, signs = self._next.line, 0
        while self._sees("-", "+"):
            signs += self._name_or_sign() == "-"
        found = self._postfix()
        return self._node("operation", line, "minus", found) if signs % 2 else found

    def _postfix(self) -> Node:
        found, chain = self._primary(), 0
        while True:
            chain = self._longer(chain)
            line = self._next.line
            if self._take("."):
                found = self._node("member_of", line, self._name(), found)
            elif self._sees("("):
                found = self._node("call", line, "", found, arguments=self._arguments())
            elif self._take("["):
                found = self._node("element", line, "", found, self._expression())
                self._need("]")
            else:
                return found

    def _arguments(self) -> tuple[Node, ...]:
        found: list[Node] = []
        self._need("(")
        while not self._take(")"):
            if found:
                self._need(",")
            line, name = self._next.line, ""
            if self._next.kind == "name" and self._sees(":", ahead=1):
                name = self._name()
                self._need(":")
            value = self._happening()
            found.append(self._node("argument", line, name, value))
        return tuple(found)

    @staticmethod
    def _text(quoted: str) -> str:
        width = 3 if quoted[:3] in ('"""', "'''") else 1
        return quoted[width:-width]

    def _primary(self) -> Node:
        kind, text, line = self._next
        if kind == "number":
            if len(text) > 40:
                self._refuse("a number of 40 digits at most")
            self._at += 1
            value = float(int(text, 16)) if text.startswith("0x") else float(text)
            unit = ""
            if self._next.kind == "name" and self._next.text not in _WORDS:
                unit = self._name()
            return self._node("number", line, unit, value=value)
        if kind == "text":
            self._at += 1
            return self._node("text", line, self._text(text))
        if self._take("("):
            found = self._expression()
            self._need(")")
            return found
        if self._take("["):
            first = self._expression()
            if self._take(".."):
                found = self._node("range", line, "", first, self._expression())
            else:
                items = [first]
                while self._take(","):
                    items.append(self._expression())
                found = self._node("list", line, "", *items)
            self._need("]")
            return found
        if kind == "name" and text in _WORDS:
            self._refuse("a value")
        name = self._kind("name", "a value").text
        if name in ("true", "false"):
            return self._node("truth", line, name)
        if self._take("!"):
            return self._node("enum_value", line, self._name(), of=name)
        return self._node("name", line, name)
