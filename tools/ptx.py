"""PTX on a host: each instruction becomes one of LLVM's, and a GPU's threads run in turn.

It knows what LLVM writes of BridgeGen's kernels, and fails at anything else. Floating-point numbers
are rounded as PTX says (``.rn``), a multiplication and an addition are one operation only where PTX
has ``fma``. Source: PTX ISA, https://docs.nvidia.com/cuda/parallel-thread-execution/.
"""

# ruff: noqa: D102, N815
# The methods of a function are named after what they write, those of a driver by NVIDIA.

import ctypes
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from llvmlite import binding as llvm

from bridgegen.base.compilation.folder import cache_folder
from bridgegen.base.disk import write_whole

SPECIAL = {"%tid.x": "tid", "%ctaid.x": "ctaid", "%ntid.x": "ntid", "%nctaid.x": "nctaid"}
BITS = {"pred": 1, **{f"{kind}{n}": n for kind in "bsuf" for n in (8, 16, 32, 64)}}
FLOAT = {32: "float", 64: "double"}
MATH = {
    "sqrt.rn": "sqrt",
    "cvt.rmi": "floor",
    "cvt.rpi": "ceil",
    "cvt.rzi": "trunc",
    "cvt.rni": "rint",
    "abs": "fabs",
    "min": "minnum",
    "max": "maxnum",
}
WORDS = ("tid", "ctaid", "ntid", "nctaid")


def width_of(parameter: str) -> int:
    """Return the bits of a parameter: a number, or an array of bytes."""
    size = re.search(r"\[(\d+)\]", parameter)
    return 8 * int(size[1]) if size else BITS[parameter.split()[1].strip(".")]


class Function:
    """One function in LLVM's IR."""

    def __init__(self, head: str, body: list[str]) -> None:
        self.lines: list[str] = []
        self.number = 0
        self.widths: dict[str, int] = {}
        is_entry = ".entry" in head
        found = re.search(r"(?:\((\.param [^)]*)\) )?([\w.$]+)\((.*?)\)\s*$", head, re.DOTALL)
        assert found, head
        result, self.name, given = found.groups()
        self.returns = f"i{width_of(result)}" if result else "void"
        self.parameters: list[tuple[str, str]] = re.findall(
            r"\.param \.(?:align \d+ \.)?(\w+)\s+([\w.$]+)", given
        )
        arguments = ", ".join(f"i{BITS[k]} %arg{i}" for i, (k, _) in enumerate(self.parameters))
        linkage = "" if is_entry else "internal "
        self.head = f'define {linkage}{self.returns} @"{self.name}"({arguments}) {{'
        self.slots: list[str] = []
        for i, (kind, name) in enumerate(self.parameters):
            self.slot(name, BITS[kind])
            self.put(f'store i{BITS[kind]} %arg{i}, ptr %"{name}"')
        if result:
            self.slot("func_retval0", width_of(result))
        self.targets: dict[str, list[str]] = {}
        self.is_ended = False
        text = "\n".join(body)
        for lines in re.findall(r"(\$\S+): \.branchtargets([^;]*);", text):
            self.targets[lines[0]] = [one.strip() for one in lines[1].split(",")]
        text = re.sub(r"\$\S+: \.branchtargets[^;]*;", "", text)
        text = re.sub(r"//[^\n]*", "", text)
        for line in text.split("\n"):
            self.line(line.strip())
        if not self.is_ended:
            self.put("unreachable")

    def text(self) -> str:
        """Return the function."""
        return "\n".join([self.head, *self.slots, *self.lines, "}"])

    def slot(self, name: str, bits: int) -> None:
        self.widths[name] = bits
        self.slots.append(f'  %"{name}" = alloca i{bits}')

    def put(self, text: str) -> None:
        self.lines.append(f"  {text}")

    def new(self, text: str) -> str:
        self.number += 1
        self.put(f"%t{self.number} = {text}")
        return f"%t{self.number}"

    def block(self, name: str) -> None:
        if not self.is_ended:
            self.put(f'br label %"{name}"')
        self.lines.append(f'"{name}":')
        self.is_ended = False

    # --- Values ---

    def get(self, operand: str, bits: int) -> str:
        """Return the bits of an operand."""
        operand = operand.strip()
        if operand in SPECIAL:
            return self.new(f"load i32, ptr @{SPECIAL[operand]}")
        if re.fullmatch(r"-?\d+|0x[0-9A-Fa-f]+", operand):
            value = int(operand, 0)
            if bits == 1:
                return "true" if value else "false"
            return str(value & ((1 << bits) - 1))
        if re.fullmatch(r"0[dD][0-9A-Fa-f]{16}", operand):
            return str(int(operand[2:], 16))
        if not operand.startswith("%"):
            return (
                self.new(f'ptrtoint ptr @"{operand}" to i64')
                if operand not in self.widths
                else self.new(f'ptrtoint ptr %"{operand}" to i64')
            )
        width = self.widths[operand]
        value = self.new(f'load i{width}, ptr %"{operand}"')
        if width == bits:
            return value
        return self.new(f"{'trunc' if width > bits else 'zext'} i{width} {value} to i{bits}")

    def real(self, operand: str, bits: int) -> str:
        return self.new(f"bitcast i{bits} {self.get(operand, bits)} to {FLOAT[bits]}")

    def set(self, register: str, bits: int, value: str, *, signed: bool = False) -> None:
        if register == "_":
            return
        width = self.widths[register]
        if width != bits:
            how = "trunc" if bits > width else "sext" if signed else "zext"
            value = self.new(f"{how} i{bits} {value} to i{width}")
        self.put(f'store i{width} {value}, ptr %"{register}"')

    def set_real(self, register: str, bits: int, value: str) -> None:
        self.set(register, bits, self.new(f"bitcast {FLOAT[bits]} {value} to i{bits}"))

    def address(self, operand: str) -> str:
        base, _, offset = operand.strip("[] ").partition("+")
        if base.startswith("%"):
            at = self.get(base, 64)
        elif base in self.widths:
            return self.new(f'getelementptr i8, ptr %"{base}", i64 {int(offset or 0)}')
        else:
            at = self.new(f'ptrtoint ptr @"{base}" to i64')
        if offset:
            at = self.new(f"add i64 {at}, {int(offset)}")
        return self.new(f"inttoptr i64 {at} to ptr")

    # --- Lines ---

    def line(self, line: str) -> None:
        if (
            not line
            or line in "{}"
            or line.startswith(".pragma")
            or line.startswith((".loc\t", ".file\t"))
        ):
            return
        if found := re.match(r"\.reg \.(\w+)\s+(%\w+)(?:<(\d+)>)?;", line):
            kind, name, count = found.groups()
            for one in [name] if count is None else [f"{name}{i}" for i in range(int(count))]:
                self.slot(one, BITS[kind])
            return
        if found := re.match(r"\.local \.align (\d+) \.b8\s+(\w+)\[(\d+)\];", line):
            align, name, size = found.groups()
            self.widths[name] = 64
            self.slots.append(f'  %"{name}" = alloca [{size} x i8], align {max(int(align), 8)}')
            return
        if found := re.match(r"\.param [^;]*?(\w+)(?:\[\d+\])?;", line):
            if found.group(1) not in self.widths:  # the name is another call's, too
                self.slot(found.group(1), 128)
            return
        if line.startswith("{"):
            return
        if found := re.match(r"(\$\w+):$", line):
            self.block(found.group(1))
            return
        if self.is_ended:
            self.block(f"dead{self.number}")
            self.number += 1
        if found := re.match(r"@(!?)(%p\d+) bra(?:\.uni)?\s+(\$\w+);", line):
            no, predicate, label = found.groups()
            value, rest = self.get(predicate, 1), f"next{self.number}"
            pair = (rest, label) if no else (label, rest)
            self.put(f'br i1 {value}, label %"{pair[0]}", label %"{pair[1]}"')
            self.is_ended = True
            self.block(rest)
            return
        found = re.match(r"([\w.]+(?:::\w+)?)\s*(.*);$", line)
        if not found:
            raise ValueError(f"not known: {line!r}")
        self.instruction(found.group(1).split("."), found.group(2), line)

    def instruction(self, parts: list[str], rest: str, line: str) -> None:
        name, kinds = parts[0], [part for part in parts[1:] if part in BITS]
        given = [one.strip() for one in re.split(r",\s*(?![^{(]*[})])", rest)] if rest else []
        if name == "bra":
            self.put(f'br label %"{rest}"')
            self.is_ended = True
            return
        if name in ("ret", "exit"):
            if name == "exit":
                self.put("store i8 1, ptr @exited")
            self.leave()
            return
        if name == "trap":
            self.put("call void @llvm.trap()")
            return
        if name == "brx":
            value = self.get(given[0], 32)
            targets = self.targets[given[1]]
            cases = " ".join(f'i32 {i}, label %"{one}"' for i, one in enumerate(targets))
            self.put(f'switch i32 {value}, label %"{targets[0]}" [ {cases} ]')
            self.is_ended = True
            return
        if name == "call":
            self.call(rest)
            return
        bits = BITS[kinds[-1]] if kinds else 64
        is_real, signed = bool(kinds) and kinds[-1][0] == "f", bool(kinds) and kinds[-1][0] == "s"
        if name in ("ld", "ldu"):
            vector = re.match(r"\{(.*)\}", given[0])
            registers = (
                [one.strip() for one in vector.group(1).split(",")] if vector else [given[0]]
            )
            at = self.address(given[1])
            for k, register in enumerate(registers):
                place = self.new(f"getelementptr i{bits}, ptr {at}, i64 {k}") if k else at
                align = "" if "param" in parts else ", align 1"
                self.set(
                    register, bits, self.new(f"load i{bits}, ptr {place}{align}"), signed=signed
                )
        elif name == "st":
            vector = re.match(r"\{(.*)\}", given[1])
            values = [one.strip() for one in vector.group(1).split(",")] if vector else [given[1]]
            at = self.address(given[0])
            for k, one in enumerate(values):
                place = self.new(f"getelementptr i{bits}, ptr {at}, i64 {k}") if k else at
                align = "" if "param" in parts else ", align 1"
                self.put(f"store i{bits} {self.get(one, bits)}, ptr {place}{align}")
        elif name in ("mov", "cvta"):
            if vector := re.match(r"\{(.*)\}", given[1] if len(given) > 1 else ""):
                pieces = [one.strip() for one in vector.group(1).split(",")]
                each, whole = bits // len(pieces), "0"
                for k, piece in enumerate(pieces):
                    wide = self.new(f"zext i{each} {self.get(piece, each)} to i{bits}")
                    wide = self.new(f"shl i{bits} {wide}, {k * each}")
                    whole = self.new(f"or i{bits} {whole}, {wide}")
                self.set(given[0], bits, whole)
            elif vector := re.match(r"\{(.*)\}", given[0]):
                pieces = [one.strip() for one in vector.group(1).split(",")]
                each, whole = bits // len(pieces), self.get(given[1], bits)
                for k, piece in enumerate(pieces):
                    part = self.new(f"lshr i{bits} {whole}, {k * each}")
                    self.set(piece, each, self.new(f"trunc i{bits} {part} to i{each}"))
            else:
                self.set(given[0], bits, self.get(given[1], bits))
        elif name == "cvt":
            self.convert(parts, kinds, given)
        elif name in ("setp", "set"):
            self.compare(parts, bits, is_real, signed, given)
        elif name == "selp":
            test, a, b = self.get(given[3], 1), self.get(given[1], bits), self.get(given[2], bits)
            self.set(given[0], bits, self.new(f"select i1 {test}, i{bits} {a}, i{bits} {b}"))
        elif is_real:
            self.reals(name, parts, bits, given, line)
        else:
            self.wholes(name, parts, bits, signed, given, line)

    def leave(self) -> None:
        if self.returns == "void":
            self.put("ret void")
        else:
            value = self.new(f'load {self.returns}, ptr %"func_retval0"')
            self.put(f"ret {self.returns} {value}")
        self.is_ended = True

    def call(self, rest: str) -> None:
        found = re.match(r"(?:\((\w+)\), )?([\w.$]+)(?:,\s*\((.*)\))?$", rest)
        if not found:
            raise ValueError(f"not known: call {rest}")
        result, callee, given = found.groups()
        self.calls = getattr(self, "calls", [])
        self.lines.append(
            (
                "CALL",
                result,
                callee,
                [g.strip() for g in (given or "").split(",") if g.strip()],
                self.number,
            )
        )
        self.number += 100
        name = f"after{self.number}"
        left = self.new("load i8, ptr @exited")
        test = self.new(f"icmp ne i8 {left}, 0")
        self.put(f'br i1 {test}, label %"out{name}", label %"{name}"')
        self.lines.append(f'"out{name}":')
        if self.returns == "void":
            self.put("ret void")
        else:
            self.put(f"ret {self.returns} 0")
        self.lines.append(f'"{name}":')

    def convert(self, parts: list[str], kinds: list[str], given: list[str]) -> None:
        to, what = kinds[0], kinds[1]
        b, a = BITS[to], BITS[what]
        if to[0] == "f" and what[0] == "f":
            x = self.real(given[1], a)
            how = MATH.get(f"cvt.{parts[1]}")
            assert a == b, parts
            assert how, parts
            self.set_real(
                given[0], b, self.new(f"call {FLOAT[a]} @llvm.{how}.f{a}({FLOAT[a]} {x})")
            )
        elif to[0] == "f":
            how = "sitofp" if what[0] == "s" else "uitofp"
            assert parts[1] == "rn", parts
            self.set_real(
                given[0], b, self.new(f"{how} i{a} {self.get(given[1], a)} to {FLOAT[b]}")
            )
        elif what[0] == "f":
            how = "fptosi" if to[0] == "s" else "fptoui"
            x = self.real(given[1], a)
            if parts[1] != "rzi":
                rounds = MATH[f"cvt.{parts[1]}"]
                x = self.new(f"call {FLOAT[a]} @llvm.{rounds}.f{a}({FLOAT[a]} {x})")
            found = self.new(f"call i{b} @llvm.{how}.sat.i{b}.f{a}({FLOAT[a]} {x})")
            self.set(given[0], b, found, signed=to[0] == "s")
        else:
            value = self.get(given[1], a)
            if b != a:
                how = "trunc" if b < a else "sext" if what[0] == "s" else "zext"
                value = self.new(f"{how} i{a} {value} to i{b}")
            self.set(given[0], b, value, signed=to[0] == "s")

    def compare(
        self, parts: list[str], bits: int, is_real: bool, signed: bool, given: list[str]
    ) -> None:
        how = parts[1]
        if is_real:
            a, b = self.real(given[1], bits), self.real(given[2], bits)
            codes = {
                "num": "ord",
                "nan": "uno",
                "ne": "one",
                "eq": "oeq",
                "neu": "une",
                "equ": "ueq",
            }
            codes |= {f"{one}u": f"u{one}" for one in ("lt", "le", "gt", "ge")}
            found = self.new(f"fcmp {codes.get(how, f'o{how}')} {FLOAT[bits]} {a}, {b}")
        else:
            a, b = self.get(given[1], bits), self.get(given[2], bits)
            codes = {"lo": "ult", "ls": "ule", "hi": "ugt", "hs": "uge"}
            sign = "s" if signed else "u"
            code = how if how in ("eq", "ne") else codes.get(how, f"{sign}{how}")
            found = self.new(f"icmp {code} i{bits} {a}, {b}")
        if len(parts) > 3 and parts[2] in ("and", "or", "xor"):
            found = self.new(f"{parts[2]} i1 {found}, {self.get(given[3], 1)}")
        self.set(given[0], 1, found)

    def reals(self, name: str, parts: list[str], bits: int, given: list[str], line: str) -> None:
        kind = FLOAT[bits]
        if name in ("add", "sub", "mul", "div"):
            assert parts[1] == "rn", line
            a, b = self.real(given[1], bits), self.real(given[2], bits)
            found = self.new(f"f{name} {kind} {a}, {b}")
        elif name == "fma":
            assert parts[1] == "rn", line
            x = [self.real(one, bits) for one in given[1:]]
            found = self.new(
                f"call {kind} @llvm.fma.f{bits}({', '.join(f'{kind} {one}' for one in x)})"
            )
        elif name == "rcp":
            assert parts[1] == "rn", line
            found = self.new(f"fdiv {kind} 1.0, {self.real(given[1], bits)}")
        elif name == "neg":
            found = self.new(f"fneg {kind} {self.real(given[1], bits)}")
        elif name == "copysign":
            sign, size = self.real(given[1], bits), self.real(given[2], bits)
            found = self.new(f"call {kind} @llvm.copysign.f{bits}({kind} {size}, {kind} {sign})")
        elif name in ("sqrt", "abs", "min", "max"):
            x = [self.real(one, bits) for one in given[1:]]
            how = MATH["sqrt.rn" if name == "sqrt" else name]
            assert name != "sqrt" or parts[1] == "rn", line
            found = self.new(
                f"call {kind} @llvm.{how}.f{bits}({', '.join(f'{kind} {one}' for one in x)})"
            )
        elif name == "testp":
            x = self.real(given[1], bits)
            tests = {
                "infinite": 516,
                "finite": 504,
                "nan": 3,
                "number": 1020,
                "normal": 264,
                "subnormal": 144,
            }
            self.set(
                given[0],
                1,
                self.new(f"call i1 @llvm.is.fpclass.f{bits}({kind} {x}, i32 {tests[parts[1]]})"),
            )
            return
        else:
            raise ValueError(f"not known: {line}")
        self.set_real(given[0], bits, found)

    def wholes(
        self, name: str, parts: list[str], bits: int, signed: bool, given: list[str], line: str
    ) -> None:
        wide = "wide" in parts
        sign = "s" if signed else "u"
        if name in ("shl", "shr"):
            a, count = self.get(given[1], bits), self.get(given[2], 32)
            many = self.new(f"zext i32 {count} to i64") if bits == 64 else count
            n = f"i{max(bits, 32)}"
            if bits < 32:
                a = self.new(f"{'sext' if signed else 'zext'} i{bits} {a} to i32")
            top = self.new(f"icmp ugt {n} {many}, {bits - 1}")
            how = "shl" if name == "shl" else "ashr" if signed else "lshr"
            capped = self.new(f"select i1 {top}, {n} {bits - 1}, {n} {many}")
            found = self.new(f"{how} {n} {a}, {capped}")
            if how != "ashr":
                found = self.new(f"select i1 {top}, {n} 0, {n} {found}")
            if bits < 32:
                found = self.new(f"trunc i32 {found} to i{bits}")
            self.set(given[0], bits, found)
            return
        x = [self.get(one, bits) for one in given[1:3]]
        if name in ("add", "sub", "and", "or", "xor"):
            found = self.new(f"{name} i{bits} {x[0]}, {x[1]}")
        elif name in ("div", "rem"):
            found = self.new(f"{sign}{name} i{bits} {x[0]}, {x[1]}")
        elif name in ("min", "max"):
            found = self.new(
                f"call i{bits} @llvm.{sign}{name}.i{bits}(i{bits} {x[0]}, i{bits} {x[1]})"
            )
        elif name in ("mul", "mad"):
            if wide or "hi" in parts:
                ext = "sext" if signed else "zext"
                a, b = (self.new(f"{ext} i{bits} {one} to i{2 * bits}") for one in x)
                found = self.new(f"mul i{2 * bits} {a}, {b}")
                if "hi" in parts:
                    found = self.new(f"lshr i{2 * bits} {found}, {bits}")
                    found = self.new(f"trunc i{2 * bits} {found} to i{bits}")
                else:
                    bits *= 2
            else:
                found = self.new(f"mul i{bits} {x[0]}, {x[1]}")
            if name == "mad":
                found = self.new(f"add i{bits} {found}, {self.get(given[3], bits)}")
        elif name == "neg":
            found = self.new(f"sub i{bits} 0, {x[0]}")
        elif name == "not":
            found = self.new(f"xor i{bits} {x[0]}, {'true' if bits == 1 else -1}")
        elif name == "abs":
            found = self.new(f"call i{bits} @llvm.abs.i{bits}(i{bits} {x[0]}, i1 false)")
        elif name == "popc":
            found = self.new(f"call i{bits} @llvm.ctpop.i{bits}(i{bits} {x[0]})")
            found, bits = (
                (self.new(f"trunc i64 {found} to i32"), 32) if bits == 64 else (found, bits)
            )
        elif name == "clz":
            found = self.new(f"call i{bits} @llvm.ctlz.i{bits}(i{bits} {x[0]}, i1 false)")
            found, bits = (
                (self.new(f"trunc i64 {found} to i32"), 32) if bits == 64 else (found, bits)
            )
        elif name == "shf":
            lo, hi, count = x[0], x[1], self.get(given[3], 32)
            how = "fshl" if "l" in parts else "fshr"
            assert "wrap" in parts, line
            found = self.new(f"call i32 @llvm.{how}.i32(i32 {hi}, i32 {lo}, i32 {count})")
        elif name == "bfe":
            assert not signed, line
            at, size = (int(one) for one in given[2:])
            found = self.new(f"lshr i{bits} {x[0]}, {at}")
            found = self.new(f"and i{bits} {found}, {(1 << size) - 1}")
        else:
            raise ValueError(f"not known: {line}")
        self.set(given[0], bits, found, signed=signed)


def functions(ptx: str) -> Iterator[Function]:
    """Yield the functions of a module."""
    pattern = r"^((?:\.visible |\.weak )?\.(?:func|entry)[^{;]*?)\n?\{\n(.*?)^\}"
    for head, body in re.findall(pattern, ptx, re.S | re.M):
        head = re.sub(r"\.(?:maxntid|reqntid|minnctapersm|noreturn)[^\n]*", "", head)
        yield Function(head.strip(), body.split("\n"))


def to_llvm(ptx: str) -> str:
    """Return a module of PTX as one of LLVM's."""
    found = {one.name: one for one in functions(ptx)}
    lines = [f"@{name} = global i32 0" for name in WORDS] + ["@exited = global i8 0"]
    pattern = (
        r"^(?:\.visible )?\.(?:const|global) \.align (\d+) \.(\w+) ([\w.$]+)"
        r"(?:\[(\d+)\])?(?: = (.*?))?;"
    )
    for align, kind, name, count, value in re.findall(pattern, ptx, re.M):
        n = int(count or 1)
        if value:
            # Addresses of what errors would say, which nobody reads: no kernel raises.
            parts = value.strip("{}").split(",")
            numbers = [0 if "generic" in part else int(part, 0) for part in parts]
            numbers += [0] * (n - len(numbers))
            text = "[" + ", ".join(f"i{BITS[kind]} {one}" for one in numbers) + "]"
        else:
            text = "zeroinitializer"
        lines.append(f'@"{name}" = global [{n} x i{BITS[kind]}] {text}, align {align}')
    for one in found.values():
        for k, line in enumerate(one.lines):
            if not isinstance(line, tuple):
                continue
            _, result, callee, given, number = line
            there = found[callee]
            calls = []
            for i, ((kind, _), name) in enumerate(zip(there.parameters, given, strict=True)):
                calls.append(f'  %c{number}.{i} = load i{BITS[kind]}, ptr %"{name}"')
            arguments = ", ".join(
                f"i{BITS[kind]} %c{number}.{i}" for i, (kind, _) in enumerate(there.parameters)
            )
            call = f'call {there.returns} @"{callee}"({arguments})'
            if result:
                calls.append(f"  %c{number}.r = {call}")
                calls.append(f'  store {there.returns} %c{number}.r, ptr %"{result}"')
            else:
                calls.append(f"  {call}")
            one.lines[k] = "\n".join(calls)
        lines.append(one.text())
    return "\n".join(lines)


class Host:
    """A module of PTX, compiled for this processor; in a minute, and kept in the cache."""

    def __init__(self, ptx: str) -> None:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine(opt=1, jit=True)
        ours = Path(__file__).read_text("utf-8").partition("class Driver:")[0]
        parts = (ptx, ours, llvm.get_default_triple())
        digest = hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]
        path = cache_folder() / f"{digest}.ptx.o"
        if not path.is_file():
            module = llvm.parse_assembly(to_llvm(ptx))
            module.triple, module.data_layout = llvm.get_default_triple(), str(machine.target_data)
            builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(1))
            builder.getModulePassManager().run(module, builder)
            write_whole(path, [machine.emit_object(module)])
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(path.read_bytes()))
        self._engine.finalize_object()

    def symbol(self, name: str) -> int:
        """Return where a variable of the module lies."""
        return int(self._engine.get_function_address(name))

    def launch(self, name: str, blocks: int, threads: int) -> None:
        """Run an entry in all threads of a grid, one after the other."""
        run = ctypes.CFUNCTYPE(None)(self._engine.get_function_address(name))
        word: dict[str, Any] = {one: ctypes.c_int32.from_address(self.symbol(one)) for one in WORDS}
        exited = ctypes.c_int8.from_address(self.symbol("exited"))
        word["ntid"].value, word["nctaid"].value = threads, blocks
        for block in range(blocks):
            for thread in range(threads):
                word["ctaid"].value, word["tid"].value = block, thread
                run()
                exited.value = 0


class Driver:
    """A pretend driver of a GPU's, see `bridgegen.base.cuda`: its memory is this process's.

    Args:
        free: bytes that the pretend GPU has.

    Attributes:
        launches: how many there were,
        widest: the largest number of blocks of one.
        fails_after: of them, from which on all fail.
    """

    hosts: ClassVar[dict[bytes, Host]] = {}

    def __init__(self, free: int = 2**30) -> None:
        self.free, self.launches, self.fails_after, self.widest = free, 0, 2**31, 0
        self.blocks: dict[int, Any] = {}

    def cuInit(self, _: int) -> int:
        return 0

    def cuDeviceGet(self, device: Any, _: int) -> int:
        return 0

    def cuDeviceGetName(self, name: Any, *_: Any) -> int:
        name.value = b"pretend"
        return 0

    def cuDeviceGetAttribute(self, value: Any, *_: Any) -> int:
        value._obj.value = 1
        return 0

    def cuDevicePrimaryCtxRetain(self, *_: Any) -> int:
        return 0

    def cuCtxSetCurrent(self, _: Any) -> int:
        return 0

    def cuCtxSetLimit(self, *_: Any) -> int:
        return 0

    def cuModuleLoadDataEx(self, module: Any, image: Any, *_: Any) -> int:
        text = image.value
        if text not in self.hosts:
            self.hosts[text] = Host(text.decode())
        self.host = self.hosts[text]
        return 0

    def cuModuleGetFunction(self, function: Any, module: Any, name: bytes) -> int:
        self.name = name.decode()
        return 0

    def cuModuleGetGlobal_v2(self, at: Any, size: Any, module: Any, name: bytes) -> int:
        at._obj.value = self.host.symbol(name.decode())
        return 0

    def cuMemGetInfo_v2(self, free: Any, total: Any) -> int:
        free._obj.value = self.free - sum(len(block) for block in self.blocks.values())
        return 0

    def cuMemAlloc_v2(self, at: Any, size: Any) -> int:
        if size.value > self.free - sum(len(block) for block in self.blocks.values()):
            return 2
        block = ctypes.create_string_buffer(size.value)
        at._obj.value = ctypes.addressof(block)
        self.blocks[at._obj.value] = block
        return 0

    def cuMemFree_v2(self, at: Any) -> int:
        del self.blocks[at.value]
        return 0

    def cuMemcpyHtoD_v2(self, to: Any, what: Any, size: Any) -> int:
        ctypes.memmove(to.value, what.value, size.value)
        return 0

    cuMemcpyDtoH_v2 = cuMemcpyHtoD_v2

    def cuMemsetD8_v2(self, at: Any, value: int, size: Any) -> int:
        ctypes.memset(at.value, value, size.value)
        return 0

    def cuLaunchKernel(self, function: Any, blocks: Any, *rest: Any) -> int:
        self.launches += 1
        self.widest = max(self.widest, blocks.value)
        self.host.launch(self.name, blocks.value, rest[2].value)
        return 0

    def cuCtxSynchronize(self) -> int:
        return 719 if self.launches > self.fails_after else 0

    def cuGetErrorName(self, code: int, name: Any) -> int:
        name._obj.value = {
            700: b"CUDA_ERROR_ILLEGAL_ADDRESS",
            719: b"CUDA_ERROR_LAUNCH_FAILED",
        }.get(code, b"")
        return 0
