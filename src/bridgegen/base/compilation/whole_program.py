"""Machine code of a kernel with all that it calls, in which bundles' shapes and numbers are known.

A kernel is compiled for bundles of any size, and each large one by itself. Here LLVM sees all at
once, as they were lowered, and constants where a kernel would read how long an array is: loops get
known lengths, branches that no row of a storyboard takes go, and what is left is inlined. Nothing
is reordered or contracted, so the bits are the same.
"""

import pickle
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from llvmlite import binding as llvm
from numba.core.registry import cpu_target

from bridgegen.base.compilation.library import CodeStore, KernelLibrary, MissingCodeError
from bridgegen.base.processes.child import connect, leave

Constants = Mapping[int, str]
"""What lies where in a bundle: byte from its start, and the constant as LLVM's IR writes it."""

HEAD = re.compile(r'^define .*?@"?([\w.$]+)"?\((.*)\)')
KIND = re.compile(r"\d+Bundle_28\w+?_2d[0-9a-f]{12}_29")
POINTER = re.compile(r"ptr [^,%]*(%arg\.\w+)(?=,|$)")
PLACE = re.compile(r"^  (%\S+) = getelementptr inbounds(?: nuw)? i8, ptr (%arg\.\w+), i64 (\d+)$")
LOAD = re.compile(r"^(  %\S+ = )load (i64|double|ptr), ptr (%[\w.]+)(?:,.*)?$")
KNOWN = {
    "i64": "{0}add {1}, 0",
    "double": "{0}select i1 true, {1}, {1}",
    "ptr": "{0}getelementptr i8, {1}, i64 0",
}
"""What stands for a load of a constant, by its type; LLVM makes the constant of it."""


def machine_code(
    codegen: Any,
    root: str,
    called: Iterable[str],
    known: Mapping[str, Constants],
    tables: Iterable[str],
    name: str,
) -> bytes:
    """Return the object file of a program.

    Args:
        codegen: Numba's code generator.
        root: symbol of the kernel.
        called: symbols of kernels that it calls by address.
        known: constants of bundles, by the mangled name of the bundle's type.
        tables: global variables that constants name, as LLVM's IR writes them.
        name: by which the object file exports the kernel; it has the kernel's parameters.

    Raises:
        MissingCodeError: the code of a kernel is not in the cache.
    """
    module, *others = (llvm.parse_bitcode(code) for code in _lowered([root, *called]))
    for other in others:
        module.link_in(other)
    # Until then each parameter, and each part of an array, has a place of its own on the stack.
    early = llvm.create_new_module_pass_manager()
    early.add_sroa_pass()
    early.add_instruction_combine_pass()
    early.run(module, codegen._module_pass_manager()[1])
    text = "\n".join(with_constants(str(module).split("\n"), known))
    # Counting references to memory that has no owner comes to nothing once it is inlined.
    text = re.sub(
        r"^(define [^@\n]*@NRT_(?:inc|dec)ref\([^\n]*?)(?: #\d+)? \{",
        r"\1 alwaysinline nounwind {",
        text,
        flags=re.MULTILINE,
    )
    text = re.sub(rf'@"?{re.escape(root)}"?\(', f"@{name}(", text)
    module = llvm.parse_assembly("\n".join([text, *tables]))
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration and part.name != name and "llvm." not in part.name:
            # Not internal: LLVM's loader takes such a name of one object for that of another.
            part.linkage = llvm.Linkage.private
    manager, builder = codegen._module_pass_manager()
    manager.run(module, builder)
    return bytes(codegen._tm.emit_object(module))


def _lowered(roots: Iterable[str]) -> Iterator[bytes]:
    """Yield kernels, and all that they call, as they were lowered."""
    left, found = list(roots), set()
    while left:
        if (symbol := left.pop(0)) in found:
            continue
        found.add(symbol)
        if (stored := KernelLibrary.store.read(symbol, "raw")) is None:
            raise MissingCodeError(symbol)
        callees, code = stored
        left += callees
        yield code


def with_constants(lines: Iterable[str], known: Mapping[str, Constants]) -> Iterator[str]:
    """Yield LLVM's IR with constants where a parameter that is a bundle is read.

    A load that has another form than these stays one, and reads the same.
    """
    bundles: dict[str, Constants] = {}
    places: dict[str, tuple[str, int]] = {}
    for line in lines:
        if head := HEAD.match(line):
            kinds, names = KIND.findall(head[1]), POINTER.findall(head[2])
            # Arrays are passed part by part, so that only bundles are pointers of one word.
            pairs = zip(names, kinds, strict=True) if len(names) == len(kinds) else ()
            bundles = {name: known[kind] for name, kind in pairs if kind in known}
            places = {name: (name, 0) for name in bundles}
        elif (place := PLACE.match(line)) and place[2] in bundles:
            places[place[1]] = place[2], int(place[3])
        elif (load := LOAD.match(line)) and load[3] in places:
            name, at = places[load[3]]
            constant = bundles[name].get(at, "")
            if constant.startswith(f"{load[2]} "):
                yield KNOWN[load[2]].format(load[1], constant)
                continue
        yield line


def main() -> None:
    """Answer one request of the parent process: arguments of `machine_code` but the first."""
    started = time.process_time()
    requests, say = connect()
    folder, *given = pickle.loads(requests.get())
    codegen = cpu_target.target_context.codegen()
    KernelLibrary.store = CodeStore(folder, codegen.magic_tuple())
    try:
        code = machine_code(codegen, *given)
        say("compiled", code, time.process_time() - started)
    except (MissingCodeError, RuntimeError) as error:  # LLVM's
        say("failed", str(error))
    leave(SystemExit(0))


if __name__ == "__main__":
    main()
