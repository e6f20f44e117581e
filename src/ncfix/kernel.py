"""Loops over arrays as machine code: compiled by numba once, kept on the disk, loaded without numba from then on.

Importing numba and reading its own cache takes 0.6 s and 130 MB; to hand kept code to the linker of LLVM takes a tenth
of the time and half of the memory. So a loop is a plain function that makes no arrays and is given room for its
results; those of a module form a `Library`, which is compiled together. The code is good until its sources, numba,
Python or the processor change.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])
Argument = Any
"""What an argument is: "i8" or "f8", with "[:]" or "[:,:]" for an array (there "u1", "b1" and "i4", too), or a tuple of
such; a tuple with names begins with its class."""

OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Of numba: divisions as numpy does them, and nothing that needs Python or numba when it runs."""
NUMBERS = {"i8": ctypes.c_int64, "f8": ctypes.c_double}
DATA = object.__basicsize__
"""Where an array has the address of its numbers: the first thing behind what every object has (numpy's C interface).
To ask the array for it takes longer than to hand over all the rest."""


@dataclass(slots=True)
class Kernel:
    """A loop that is compiled; called as the loop is, with contiguous arrays of the types that were declared.

    It returns the whole number that the loop returns, 0 if that returns nothing.
    """

    loop: Callable[..., int | None]
    arguments: tuple[Argument, ...]
    library: Library
    code: Callable[..., int] | None = field(default=None, init=False)
    kinds: tuple[tuple[np.dtype[Any], int], ...] = field(init=False)

    def __post_init__(self) -> None:
        named = (each for each in flat(self.arguments) if isinstance(each, str))
        self.kinds = tuple((np.dtype(each[:2]), each.count(":")) for each in named)

    def __call__(self, *given: Any) -> int:
        """Run it. Raises TypeError for other arguments than those declared."""
        if self.code is None:
            self.library.load()
        assert self.code is not None
        values: list[Any] = []
        for value, (kind, dimensions) in zip(flat(given), self.kinds, strict=True):
            if dimensions:
                if value.dtype != kind or value.ndim != dimensions or not value.flags.c_contiguous:
                    raise TypeError(
                        f"{self.loop.__name__} was given {value.dtype} {value.shape} instead of {kind.str[1:]}"
                    )
                address = ctypes.c_void_p.from_address(id(value) + DATA).value
                values += (None, None, value.size, kind.itemsize, address, *value.shape, *value.strides)
            else:
                values.append(value)
        result, trouble = ctypes.c_int64(), ctypes.c_void_p()
        if self.code(ctypes.byref(result), ctypes.byref(trouble), *values):
            raise AssertionError(f"{self.loop.__name__} has failed")
        return result.value

    def bind(self, address: int) -> None:
        """Take the machine code at an address: numba hands over results by a pointer, and arrays by their parts."""
        types: list[Any] = [ctypes.c_void_p, ctypes.c_void_p]
        for kind, dimensions in self.kinds:
            if dimensions:
                types += [ctypes.c_void_p] * 2 + [ctypes.c_int64] * 2
                types += [ctypes.c_void_p] + [ctypes.c_int64] * (2 * dimensions)
            else:
                types.append(NUMBERS[kind.str[1:]])
        self.code = ctypes.CFUNCTYPE(ctypes.c_int32, *types)(address)


@dataclass(slots=True)
class Library:
    """The kernels of a module.

    source   the file of the module
    parts    functions of other modules that its loops are made of
    helpers  those of its own
    """

    source: str
    parts: tuple[Callable[..., Any], ...] = ()
    helpers: list[Callable[..., Any]] = field(default_factory=list)
    kernels: list[Kernel] = field(default_factory=list)

    def helper(self, function: Function) -> Function:
        """Take a function that loops are made of."""
        self.helpers.append(function)
        return function

    def kernel(self, *arguments: Argument) -> Callable[[Callable[..., int | None]], Kernel]:
        """Take a loop with these arguments."""

        def taken(loop: Callable[..., int | None]) -> Kernel:
            self.kernels.append(Kernel(loop, arguments, self))
            return self.kernels[-1]

        return taken

    def load(self) -> None:
        """Make the kernels ready to run: by what is kept on the disk, or by compiling them."""
        llvm = binding()
        code = self._kept()
        if code is None:
            code = self._compiled()
            self._keep(code)
        engine = linker()
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        for kernel in self.kernels:
            kernel.bind(engine.get_function_address(self._symbol(kernel)))

    def _symbol(self, kernel: Kernel) -> str:
        return f"{kernel.loop.__module__}.{kernel.loop.__name__}"

    def _compiled(self) -> bytes:
        """The machine code of all kernels. Takes seconds."""
        from numba import njit, types
        from numba.extending import register_jitable

        for function in (*self.parts, *self.helpers):  # to hand arrays over to one takes longer than most of them do
            register_jitable(forceinline=True)(function)
        llvm = binding()
        module = llvm.parse_assembly("")
        for kernel in self.kernels:
            compiled = njit(typed(kernel.arguments, types), **OPTIONS)(kernel.loop)
            (signature, found), *_ = compiled.overloads.items()
            text = compiled.inspect_llvm(signature).replace(found.fndesc.llvm_func_name, self._symbol(kernel))
            module.link_in(llvm.parse_assembly(text))
        code: bytes = target().emit_object(module)
        return code

    # -- on the disk --------------------------------------------------------------------------------------------------

    def _kept(self) -> bytes | None:
        """The code that is kept, if it is of these sources."""
        for place in places(self.source, "o"):
            with suppress(OSError):
                data = place.read_bytes()
                if data[:64] == self._digest(data[64:]):
                    return data[64:]
        return None

    def _keep(self, code: bytes) -> None:
        keep(self.source, "o", self._digest(code) + code)

    def _digest(self, code: bytes) -> bytes:
        """What tells whether code belongs to the sources, and is whole."""
        files = {self.source, *(function.__code__.co_filename for function in self.parts)}
        found = hashlib.sha256(environment().encode())
        for text in (*(Path(file).read_bytes() for file in sorted(files)), code):
            found.update(hashlib.sha256(text).digest())
        return found.hexdigest().encode()


def trusted(trial: str = "ncfix.kernel_trial") -> bool:
    """Whether this numba passes arguments as `Kernel` says, which it does not promise.

    Tried once for each environment in a process of its own, where a wrong guess can do no harm.
    """
    source = str(Path(__file__).parent / f"{trial.rpartition('.')[2]}.py")
    if not any(place.exists() for place in places(source, "passed")):
        script = f"import sys, {trial} as trial; sys.exit(not trial.passes())"
        try:
            subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
        except (OSError, subprocess.SubprocessError):
            return False
        keep(source, "passed", b"")
    return True


def places(source: str, kind: str) -> Iterator[Path]:
    """Where something about a module may be kept: beside what Python keeps of it, or in the user's own cache."""
    name = f"{Path(source).stem}.{environment()[:12]}.{kind}"
    yield Path(source).parent / "__pycache__" / name
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    yield caches / "ncfix" / f"{Path(source).parent.name}-{name}"


def keep(source: str, kind: str, data: bytes) -> None:
    """Keep it at the first place that can be written to."""
    for place in places(source, kind):
        with suppress(OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            temporary = place.with_suffix(f".{os.getpid()}")
            temporary.write_bytes(data)
            os.replace(temporary, place)
            return


def flat(nested: Any) -> list[Any]:
    """What tuples in tuples hold."""
    found: list[Any] = []
    for each in nested:
        if isinstance(each, tuple):
            found += flat(each)
        else:
            found.append(each)
    return found


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


def binding() -> Any:
    """LLVM, which numba brings along."""
    import llvmlite.binding  # type: ignore[import-untyped]

    return llvmlite.binding


@cache
def environment() -> str:
    """What else machine code depends on, as a digest."""
    llvm = binding()
    features = llvm.get_host_cpu_features().flatten()
    known = (sys.version, version("numba"), version("llvmlite"), np.__version__, llvm.get_host_cpu_name(), features)
    return hashlib.sha256(repr(known).encode()).hexdigest()


@cache
def target() -> Any:
    """This processor, as LLVM writes code for it."""
    llvm = binding()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    machine = llvm.Target.from_triple(llvm.get_process_triple())
    return machine.create_target_machine(cpu, features, opt=3, codemodel="jitdefault", jit=True)


@cache
def linker() -> Any:
    """What puts machine code into memory and joins it."""
    llvm = binding()
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target())
