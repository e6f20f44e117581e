"""Builds the compiled core where there are a C compiler and Python's headers; hatchling runs it.

NCFIX_BUILD  unset    compile; where that fails, install without
             require  compile, or fail
             abi3     the same, for all of CPython from 3.11 on (the wheels that are published)
             plain    do not compile
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from runpy import run_path
from sysconfig import get_platform
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

CORE = Path("src/ncfix/core")
RECORD = "compiled.txt"
"""Beside the binaries: of which sources they are, see `ncfix.core`."""
SHARED = "ncfix.core._memoryviews"
"""What Cython puts into every module otherwise: that would triple the time to compile."""
FLAGS = ["-O3", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-g0"]
"""Every operation as it is written: a fused or reordered one would give other last bits than the source interpreted."""
WINDOWS_FLAGS = ["/O2", "/fp:precise"]
SUPPORTED = sys.implementation.name == "cpython" and sys.maxsize > 1 << 32
"""Elsewhere numpy's indices have 32 bits, and the core takes 64; or Cython's code is slower than numpy's."""
STABLE: dict[str, Any] = {"py_limited_api": True, "define_macros": [("Py_LIMITED_API", "0x030B0000")]}
DIRECTIVES = {
    "language_level": 3,
    "annotation_typing": False,
    "infer_types": True,
    "boundscheck": True,
    "wraparound": False,
    "initializedcheck": False,
    "cdivision": False,
    "freethreading_compatible": True,
}


class CompiledCore(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the binaries to a wheel, or puts them beside the sources of an editable install."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """See `BuildHookInterface`."""
        wish, core = os.environ.get("NCFIX_BUILD", ""), Path(self.root, CORE)
        if version == "editable":
            for old in (*core.glob("*.so"), *core.glob("*.pyd"), *core.glob(RECORD)):
                old.unlink()
        if wish == "plain" or (not wish and not SUPPORTED):
            return
        try:
            found = compiled(Path(self.root), stable=wish == "abi3")
        except Exception as failure:
            if wish:
                raise
            self.app.display_warning(f"ncfix is installed without its compiled core: {failure}")
            return
        build_data["pure_python"] = False
        if wish == "abi3":
            platform = get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"cp311-abi3-{platform}"
        else:
            build_data["infer_tag"] = True
        for path in found:
            if version == "editable":
                core.joinpath(path.name).write_bytes(path.read_bytes())
            else:
                build_data["force_include"][str(path)] = f"ncfix/core/{path.name}"


def compiled(root: Path, *, stable: bool) -> list[Path]:
    """The binaries of all modules that have declarations (`.pxd`), and the record of their sources."""
    from Cython.Build import cythonize
    from setuptools import Distribution, Extension
    from setuptools.command.build_ext import build_ext

    digest = run_path(str(root / CORE / "__init__.py"))["digest"]  # the package itself is not importable yet
    before = Path.cwd()
    os.chdir(root / "src")
    try:
        names = sorted(path.stem for path in Path("ncfix/core").glob("*.pxd"))
        flags, more = WINDOWS_FLAGS if sys.platform == "win32" else FLAGS, STABLE if stable else {}
        wanted = [Extension(f"ncfix.core.{n}", [f"ncfix/core/{n}.py"], extra_compile_args=flags, **more) for n in names]
        wanted.append(Extension(SHARED, [], extra_compile_args=flags, **more))
        build = root / "build"
        anew = is_newer(Path(__file__), build / RECORD)
        options = {"compiler_directives": DIRECTIVES, "shared_utility_qualified_name": SHARED, "quiet": True}
        modules = cythonize(wanted, build_dir=str(build / "c"), force=anew, **options)
        command = build_ext(Distribution({"ext_modules": modules}))
        command.build_lib, command.build_temp, command.force = str(build / "lib"), str(build / "temp"), anew
        command.parallel = os.cpu_count()
        command.ensure_finalized()
        command.run()
        found = [Path(command.get_ext_fullpath(each.name)).resolve() for each in wanted]
        found.append(build / RECORD)
        found[-1].write_text(digest(root / CORE) + "\n")
        return found
    finally:
        os.chdir(before)


def is_newer(script: Path, record: Path) -> bool:
    """Whether nothing was compiled yet, or this script, and with it flags and directives, has changed since."""
    return not record.exists() or record.stat().st_mtime < script.stat().st_mtime
