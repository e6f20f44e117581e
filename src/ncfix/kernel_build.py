"""The machine code of kernels: numba says what their loops mean, LLVM makes it fast, once for all those of a module.

Left alone, numba optimizes each helper and emits its machine code, then does so again with each function that it is put
into, up to the loop: that takes longer than all the rest. So numba only lowers. LLVM goes over the functions one by
one, then over the module, in which helpers can be called by nobody else: it puts them into loops where that is worth
it, and hands over no more of an array than is looked at. The loops are as fast as with all helpers put into them.

numba takes this from the environment, before it is imported (`kernel.LOWERED_ONLY`), and needs 280 MB: so it runs in a
process of its own, `python -m ncfix.kernel_build PARENT TRIAL MODULE...`, which writes the code to standard output.
"""

from __future__ import annotations

import gc
import pickle
import sys
from functools import reduce
from importlib import import_module
from itertools import chain
from typing import Any

from ncfix.host import tie_to
from ncfix.kernel import Argument, Kernel, Library, binding, target

OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Of numba: divisions as numpy does them, and nothing that needs Python or numba when it runs."""
SELDOM = 100_000, 20, 100
"""How seldom garbage in circles is looked for: lowering leaves 60 MB of it, but to look for it takes time."""
LOOP = ".loop"
"""Behind the name of a kernel: that of its loop as numba has lowered it."""
DATA = object.__basicsize__
SHAPE, STEPS = DATA + 16, DATA + 24
"""Where an array has the addresses of its numbers, its shape and its strides, in bytes (numpy's C interface)."""
NOTHING_INSIDE = -1000
"""Limit of what a function may cost to be put into others: none is."""


def compiled(library: Library) -> bytes:
    """The machine code of all kernels of a library. Takes seconds."""
    module = lowered(library)
    symbols = {kernel.symbol for kernel in library.kernels}
    _optimize(module, inlining_threshold=NOTHING_INSIDE)
    for function in module.functions:
        if not function.is_declaration and function.name not in symbols:
            function.linkage = "internal"
    _optimize(module, loop_vectorization=True, loop_interleaving=True, loop_unrolling=True)
    code: bytes = target().emit_object(module)
    return code


def _optimize(module: Any, **wanted: int) -> None:
    """Let LLVM make a module fast; loops stay as they are where nothing else is wanted of its `PipelineTuningOptions`.

    What is unrolled once is not turned into vector instructions any more.
    """
    llvm = binding()
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    for name in ("loop_vectorization", "loop_interleaving", "loop_unrolling"):
        setattr(options, name, False)
    for name, value in wanted.items():
        setattr(options, name, value)
    builder = llvm.create_pass_builder(target(), options)
    builder.getModulePassManager().run(module, builder)


def lowered(library: Library) -> Any:
    """The kernels and all that they call as one module of LLVM."""
    from numba import njit, types
    from numba.extending import register_jitable

    for function in (*library.parts, *library.helpers):
        register_jitable(**OPTIONS)(function)
    llvm = binding()
    module = llvm.parse_assembly("")
    for kernel in library.kernels:
        compiled = njit(typed(kernel.arguments, types), **OPTIONS)(kernel.loop)
        (signature, found), *_ = compiled.overloads.items()
        text = compiled.inspect_llvm(signature).replace(found.fndesc.llvm_func_name, kernel.symbol + LOOP)
        module.link_in(llvm.parse_assembly(text))
        module.link_in(llvm.parse_assembly(entry(kernel)))
    return module


def entry(kernel: Kernel) -> str:
    """A function that takes all arguments of a kernel as words of eight bytes, arrays as Python has them.

    To hand over an array costs next to nothing so; numba wants it in seven parts and more. Results come by a pointer.
    """
    from llvmlite import ir  # type: ignore[import-untyped]

    word, real, place = ir.IntType(64), ir.DoubleType(), ir.IntType(8).as_pointer()
    parts = [place, place, word, word, place]
    types = [[*parts, *[word] * (2 * n)] if n else [real if kind == "f8" else word] for kind, n in kernel.kinds]
    module = ir.Module()
    module.triple, module.data_layout = binding().get_process_triple(), str(target().target_data)
    taken = [word.as_pointer(), place.as_pointer(), *chain(*types)]
    loop = ir.Function(module, ir.FunctionType(ir.IntType(32), taken), kernel.symbol + LOOP)
    function = ir.Function(module, ir.FunctionType(ir.IntType(32), [word.as_pointer()] * 2), kernel.symbol)
    code = ir.IRBuilder(function.append_basic_block())

    def at(start: Any, offset: int, kind: Any) -> Any:
        """What stands so many bytes behind an address."""
        return code.load(code.inttoptr(code.add(start, word(offset)), kind.as_pointer()))

    result, given = function.args
    values, start = [result, code.alloca(place)], code.ptrtoint(given, word)
    for number, (kind, dimensions) in enumerate(kernel.kinds):
        if not dimensions:
            values.append(at(start, 8 * number, real if kind == "f8" else word))
            continue
        array = at(start, 8 * number, word)
        shape, steps = ([at(at(array, each, word), 8 * k, word) for k in range(dimensions)] for each in (SHAPE, STEPS))
        values += [place(None), place(None), reduce(code.mul, shape), word(kind.itemsize), at(array, DATA, place)]
        values += [*shape, *steps]
    code.ret(code.call(loop, values))
    return str(module)


def typed(arguments: tuple[Argument, ...], types: Any) -> Any:
    """The types of arguments, as numba has them."""
    return tuple(_type(each, types) for each in arguments)


def _type(argument: Argument, types: Any) -> Any:
    if isinstance(argument, tuple):
        named = isinstance(argument[0], type)
        found = typed(argument[1:] if named else argument, types)
        return types.NamedTuple(found, argument[0]) if named else types.Tuple(found)
    names = {"i8": types.int64, "i4": types.int32, "u1": types.uint8, "b1": types.boolean, "f8": types.float64}
    dimensions = argument.count(":")
    return types.Array(names[argument[:2]], dimensions, "C") if dimensions else names[argument[:2]]


def main(parent: str, trial: str, *modules: str) -> None:
    """Try whether kernels can be trusted; compile those of these modules, and write them to standard output.

    parent  number of the process that waits for them: nobody else would
    """
    tie_to(int(parent))
    gc.disable()  # next to nothing becomes garbage in circles while numba is imported
    if not import_module(trial).passes():
        sys.exit("this numba passes arguments in another way")
    gc.freeze()
    gc.set_threshold(*SELDOM)
    gc.enable()
    libraries = [import_module(module).LIBRARY for module in modules]
    pickle.dump([library.sealed(compiled(library)) for library in libraries], sys.stdout.buffer)


if __name__ == "__main__":
    main(*sys.argv[1:])
