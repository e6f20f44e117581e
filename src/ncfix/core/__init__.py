"""The compiled core: loops over bytes, blocks, poses and motions, compiled by Cython from the modules in this folder.

Each module is plain Python; the file of the same name that ends in `.pxd` gives its variables C types. So the same
source also runs interpreted: tests compare both forms bit by bit. Without a compiled form, or with `NCFIX_CORE=plain`,
blocks are followed and written by the interpreted form (`loops`), and numpy scans the text and does the kinematics,
with the same results. `build_core.py` compiles it.
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
"""Environment variable: `plain` or `compiled`; if unset, the compiled form where there is one."""
BUILD = "with a C compiler and Python's headers, pip install --no-cache-dir --force-reinstall --no-deps ncfix"


class UnusableCoreError(ImportError):
    """The form of the core that was asked for does not exist, or is out of date."""


_form: str | None = None
_said = False


def digest(folder: Path) -> str:
    """A digest of all sources that are compiled, so that a binary of older sources is recognised."""
    found = sha256()
    for declarations in sorted(folder.glob("*.pxd")):
        for path in (declarations, declarations.with_suffix(".py")):
            found.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return found.hexdigest()


def names() -> list[str]:
    """Names of the modules that are compiled."""
    return sorted(path.stem for path in FOLDER.glob("*.pxd"))


def has_binary() -> bool:
    """Whether there is a compiled form, of these sources or of older ones."""
    return any(FOLDER.joinpath("scan" + suffix).exists() for suffix in EXTENSION_SUFFIXES)


@cache
def fault() -> str:
    """Why the compiled form cannot be used; empty if it can."""
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
    """Use the `plain` or the `compiled` form from now on; None: what the environment says.

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
    """One line: the form in use, and the reason."""
    if engaged():
        return "compiled"
    return fault() or f"compiled, but {WISH}=plain asks for the plain form"


def forewarn(say: Callable[[str], object]) -> None:
    """Warn once, before much work, that there is no compiled form; silent if there is one, or a form was asked for."""
    global _said
    if not (engaged() or _said or os.environ.get(WISH)):
        _said = True
        say(f"The core of ncfix is {fault()}")


def interpreted(name: str) -> ModuleType:
    """The interpreted form of a module of the core, also where the compiled one exists."""
    full = f"ncfix.core._interpreted_{name}"
    if full not in sys.modules:
        spec = spec_from_loader(full, SourceFileLoader(full, str(FOLDER / f"{name}.py")))
        assert spec is not None
        assert spec.loader is not None
        sys.modules[full] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[full])
    return sys.modules[full]


def loops(name: str) -> Any:
    """A module of the core in the form in use."""
    return import_module(f"ncfix.core.{name}") if engaged() else Interpreted(interpreted(name))


class Interpreted:
    """A module of the interpreted core, or an object made by it, that can be called with arrays.

    Arrays are passed on as memoryviews, which are indexed faster and yield Python numbers.
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
    """An argument as the interpreted core takes it: a memoryview for an array, its own object for a wrapper."""
    if isinstance(value, Interpreted):
        return value._own
    if not hasattr(value, "__array_interface__"):
        return value
    return memoryview(value) if value.ndim else value.item()
