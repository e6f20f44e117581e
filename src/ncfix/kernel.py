"""Loops over arrays as machine code: compiled by numba once, kept on the disk, loaded without numba from then on.

Importing numba and reading its own cache takes 0.6 s and 130 MB; to hand kept code to the linker of LLVM takes a tenth
of the time and half of the memory. So a loop is a plain function that makes no arrays and is given room for its
results; those of a module form a `Library`, which is compiled together, in another process (`kernel_build`). The code
is good until its sources, the numbers that it takes from elsewhere, numba, Python or the processor change.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from struct import Struct
from typing import IO, Any, TypeVar

import numpy as np

from ncfix.host import cache_folders, processors

Function = TypeVar("Function", bound=Callable[..., Any])
Argument = Any
"""What an argument is: "i8" or "f8", with "[:]" or "[:,:]" for an array (there "u1", "b1" and "i4", too), or a tuple of
such; a tuple with names begins with its class."""

TRIAL = "ncfix.kernel_trial"
"""What is tried before anything is compiled: whether this numba passes arguments as `Kernel` says."""
LOWERED_ONLY = {"NUMBA_OPT": "0", "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1"}
"""What numba reads when it is imported: machine code of its own is not wanted, nor colours in what it tries in vain."""
WAIT = "The loops of ncfix[fast] are compiled for this computer, once; that takes some 15 s."
WORDS = {"i8": "q", "f8": "d"}
"""Numbers as they are handed over, eight bytes each."""


class CompilingError(Exception):
    """Loops could not be compiled: numba is one that does not fit, or a process was ended."""


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
    form: Struct = field(init=False)

    def __post_init__(self) -> None:
        named = (each for each in flat(self.arguments) if isinstance(each, str))
        self.kinds = tuple((np.dtype(each[:2]), each.count(":")) for each in named)
        self.form = Struct("".join("P" if dimensions else WORDS[kind.str[1:]] for kind, dimensions in self.kinds))

    def __call__(self, *given: Any) -> int:
        """Run it. Raises TypeError for other arguments than those declared."""
        if self.code is None:
            ready([self.library])
        assert self.code is not None
        words: list[Any] = []
        for value, (kind, dimensions) in zip(flat(given), self.kinds, strict=True):
            if not dimensions:
                words.append(value)
            elif value.dtype == kind and value.ndim == dimensions and value.flags.c_contiguous:
                words.append(id(value))
            else:
                raise TypeError(f"{self.loop.__name__} was given {value.dtype} {value.shape} instead of {kind.str[1:]}")
        result = ctypes.c_int64()
        if self.code(ctypes.byref(result), self.form.pack(*words)):
            raise AssertionError(f"{self.loop.__name__} has failed")
        return result.value

    @property
    def symbol(self) -> str:
        """The name of its machine code."""
        return f"{self.loop.__module__}.{self.loop.__name__}"

    def bind(self, address: int) -> None:
        """Take the machine code at an address, see `kernel_build.entry`."""
        self.code = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_char_p)(address)


@dataclass(slots=True)
class Library:
    """The kernels of a module.

    module   its name
    parts    functions of other modules that its loops are made of
    helpers  those of its own
    """

    module: str
    parts: tuple[Callable[..., Any], ...] = ()
    helpers: list[Callable[..., Any]] = field(default_factory=list)
    kernels: list[Kernel] = field(default_factory=list)
    loaded: bool = False

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

    @property
    def source(self) -> str:
        """The file of the module."""
        return str(sys.modules[self.module].__file__)

    @property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """All that its machine code is made of."""
        return (*self.parts, *self.helpers, *(kernel.loop for kernel in self.kernels))

    def load(self) -> bool:
        """Make the kernels ready to run if there is code that is kept, of these sources; whether they are."""
        for place in () if self.loaded else places(self.source, "o"):
            with suppress(OSError):
                if self.take(place.read_bytes()):
                    break
        return self.loaded

    def take(self, data: bytes) -> bool:
        """Make the kernels ready to run by code as `sealed` gives it, if it is of these sources; whether it is."""
        code = data[64:]
        if data[:64] == self._digest(code):
            self.link(code)
        return self.loaded

    def link(self, code: bytes) -> None:
        """Make the kernels ready to run by their machine code."""
        engine = linker()
        engine.add_object_file(binding().ObjectFileRef.from_data(code))
        engine.finalize_object()
        for kernel in self.kernels:
            kernel.bind(engine.get_function_address(kernel.symbol))
        self.loaded = True

    def sealed(self, code: bytes) -> bytes:
        """Machine code as it is kept: behind what tells that it is of these sources, and whole."""
        return self._digest(code) + code

    def _digest(self, code: bytes) -> bytes:
        files = {self.source, str(Path(__file__).with_name("kernel_build.py"))}
        files.update(function.__code__.co_filename for function in self.functions)
        found = hashlib.sha256(environment().encode())
        for text in (*(Path(file).read_bytes() for file in sorted(files)), code):
            found.update(hashlib.sha256(text).digest())
        for function in self.functions:
            found.update(repr(constants(function)).encode())
        return found.hexdigest().encode()


def constants(function: Callable[..., Any]) -> list[tuple[str, Any]]:
    """Numbers that a function takes from its module, which may have them from others."""
    known = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    return [(name, np.asarray(it).tolist()) for name, it in known if isinstance(it, int | float | tuple | np.ndarray)]


# -- compiling --------------------------------------------------------------------------------------------------------


def ready(libraries: Sequence[Library], say: Callable[[str], object] = lambda text: None) -> None:
    """Make libraries ready to run. What is not kept yet, or of other sources, is compiled; `say` is told of it before.

    Raises CompilingError.
    """
    missing = [library for library in libraries if not library.load()]
    if missing:
        say(WAIT)
        with alone():
            build([library for library in missing if not library.load()])


def build(libraries: Sequence[Library]) -> None:
    """Compile libraries in processes of their own, as many as there are processors. Raises CompilingError."""
    shares = dealt(libraries, processors())
    started = [_started(share) for share in shares]
    done = [(share, process, *process.communicate()) for share, process in zip(shares, started, strict=True)]
    for share, process, found, trouble in done:
        if process.returncode:
            raise CompilingError(trouble.decode(errors="replace").strip() or f"ended with {process.returncode}")
        for library, data in zip(share, _received(found), strict=True):
            if not library.take(data):
                raise CompilingError(f"{library.source} was changed while it was compiled")
            keep(library.source, "o", data)


def _started(share: Iterable[Library]) -> subprocess.Popen[bytes]:
    """A process that compiles libraries; it imports from where this one does, and not from the working folder."""
    modules = [TRIAL, *(library.module for library in share)]
    command = [sys.executable or "", "-P", "-m", "ncfix.kernel_build", str(os.getpid()), *modules]
    known = {**os.environ, **LOWERED_ONLY, "PYTHONPATH": os.pathsep.join(sys.path)}
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=known)
    except OSError as error:
        raise CompilingError(str(error)) from error


def _received(found: bytes) -> list[bytes]:
    """What a process that compiles has written. Raises CompilingError if something else came."""
    try:
        codes: list[bytes] = pickle.loads(found)
    except Exception as error:  # pickle says in any way that something is none
        raise CompilingError(f"instead of machine code came {found[:80]!r}") from error
    return codes


def dealt(libraries: Iterable[Library], most: int) -> list[list[Library]]:
    """Libraries in at most so many shares of work; that is about as much as there are functions."""
    shares: list[list[Library]] = [[] for _ in range(most)]
    for library in sorted(libraries, key=lambda each: -len(each.functions)):
        min(shares, key=lambda share: sum(len(each.functions) for each in share)).append(library)
    return [share for share in shares if share]


@contextmanager
def alone() -> Iterator[None]:
    """Wait until no other process compiles, so that nothing is compiled twice; where nothing is kept, it is."""
    with ExitStack() as held:
        with suppress(ImportError, OSError):  # Windows; or no place can be written to
            from fcntl import LOCK_EX, flock

            flock(held.enter_context(_lock()), LOCK_EX)
        yield


def _lock() -> IO[bytes]:
    """A file at the first place that can be written to; raises OSError if none can."""
    for place in places(__file__, "lock"):
        with suppress(OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            return place.open("wb")
    raise OSError("nothing can be kept")


# -- on the disk ------------------------------------------------------------------------------------------------------


def places(source: str, kind: str) -> Iterator[Path]:
    """Where something about a module may be kept: beside what Python keeps of it, or in the user's own cache."""
    name = f"{Path(source).stem}.{environment()[:12]}.{kind}"
    beside, *elsewhere = cache_folders(source)
    yield beside / name
    yield from (folder / f"{Path(source).parent.name}-{name}" for folder in elsewhere)


def keep(source: str, kind: str, data: bytes) -> None:
    """Keep it at the first place that can be written to."""
    for place in places(source, kind):
        temporary = place.with_suffix(f".{os.getpid()}")
        with suppress(OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(data)
            os.replace(temporary, place)
            return
        with suppress(OSError):  # a full disk
            temporary.unlink()


def flat(nested: Any) -> list[Any]:
    """What tuples in tuples hold."""
    found: list[Any] = []
    for each in nested:
        if isinstance(each, tuple):
            found += flat(each)
        else:
            found.append(each)
    return found


def binding() -> Any:
    """LLVM, which numba brings along. Raises CompilingError where it is missing or cannot be opened."""
    try:
        import llvmlite.binding  # type: ignore[import-untyped]
    except (ImportError, OSError) as error:
        raise CompilingError(f"llvmlite: {error}") from error

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
