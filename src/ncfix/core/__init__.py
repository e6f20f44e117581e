"""The compiled core: loops over bytes, blocks, poses and motions, compiled by Cython from the modules in this folder.

Each module is plain Python; the file of the same name that ends in `.pxd` gives its variables C types. So the same
source also runs interpreted: tests hold both forms together, bit by bit. Where there is no compiled form, or where
`NCFIX_CORE=plain` asks for that, blocks are followed and written by the interpreted one (`loops`); columns of numpy
scan the text and do the kinematics there, with the same results. `build_core.py` compiles it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import cache, partial
from hashlib import sha256
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

FOLDER = Path(__file__).parent
WISH = "NCFIX_CORE"
"""The environment: `plain` or `compiled`; whichever there is, if unset."""
BUILD = "with a C compiler and Python's headers, pip install --no-cache-dir --force-reinstall --no-deps ncfix"


class UnusableCoreError(ImportError):
    """The form of the core that is asked for is not there."""


_form: str | None = None
_said = False


def digest(folder: Path) -> str:
    """A digest of all sources in a folder that are compiled: an old binary must not be taken for an edited source."""
    found = sha256()
    for declarations in sorted(folder.glob("*.pxd")):
        for path in (declarations, declarations.with_suffix(".py")):
            found.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return found.hexdigest()


def names() -> list[str]:
    """The modules that are compiled."""
    return sorted(path.stem for path in FOLDER.glob("*.pxd"))


def has_binary() -> bool:
    """Whether a compiled form is there, of these sources or of others."""
    return any(FOLDER.joinpath("scan" + suffix).exists() for suffix in EXTENSION_SUFFIXES)


@cache
def fault() -> str:
    """Why there is no compiled form that may be used; empty if there is one."""
    if not has_binary():
        return f"not compiled, so that long programs take up to twenty times as long: {BUILD}"
    try:
        right = FOLDER.joinpath("compiled.txt").read_text().strip() == digest(FOLDER)
    except OSError:
        right = False
    return "" if right else "compiled from other sources than these, and not used: pip install -e . again"


def engaged() -> bool:
    """Whether the compiled form is in use."""
    global _form
    if _form is None:
        _form = _wished()
    return _form == "compiled"


def use(form: str | None) -> None:
    """Take the `plain` or the `compiled` form from here on; None: as the environment says.

    Raises UnusableCoreError.
    """
    global _form
    if form == "compiled" and fault():
        raise UnusableCoreError(f"the core is {fault()}")
    _form = form


def _wished() -> str:
    wish = os.environ.get(WISH, "")
    if wish not in ("", "plain", "compiled"):
        raise UnusableCoreError(f"{WISH} is {wish!r}; it may be 'plain' or 'compiled'")
    if wish == "compiled" and fault():
        raise UnusableCoreError(f"{WISH}=compiled, but the core is {fault()}")
    return "plain" if wish == "plain" or fault() else "compiled"


def status() -> str:
    """Which form is in use and why, in one line."""
    if engaged():
        return "compiled"
    return fault() or f"compiled, but {WISH}=plain asks for the plain form"


def forewarn(say: Callable[[str], object]) -> None:
    """Say once, ahead of much work, that there is no compiled form; nothing where it is, or is not wanted."""
    global _said
    if not (engaged() or _said or os.environ.get(WISH)):
        _said = True
        say(f"The core of ncfix is {fault()}")


def interpreted(name: str) -> ModuleType:
    """A module of the core as it is without a compiler, beside the compiled one."""
    full = f"ncfix.core._interpreted_{name}"
    if full not in sys.modules:
        spec = spec_from_loader(full, SourceFileLoader(full, str(FOLDER / f"{name}.py")))
        assert spec is not None
        assert spec.loader is not None
        sys.modules[full] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[full])
    return sys.modules[full]


def loops(name: str) -> Any:
    """A module of the core in the form that is in use."""
    return import_module(f"ncfix.core.{name}") if engaged() else Interpreted(interpreted(name))


class Interpreted:
    """A module of the interpreted core, or an object that it has made, for callers that have arrays.

    It gets memoryviews of them: these are indexed faster, and what they hold are Python's own numbers.
    """

    def __init__(self, own: Any) -> None:
        self._own = own

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._own, name)
        return partial(self._call, found) if callable(found) else found

    @staticmethod
    def _call(function: Any, *given: Any) -> Any:
        result = function(*map(_as_interpreted, given))
        return Interpreted(result) if isinstance(function, type) else result


def _as_interpreted(value: Any) -> Any:
    """What the interpreted core takes for an argument: an array, a number, or an object of its own."""
    if isinstance(value, Interpreted):
        return value._own
    if not hasattr(value, "__array_interface__"):
        return value
    return memoryview(value) if value.ndim else value.item()
