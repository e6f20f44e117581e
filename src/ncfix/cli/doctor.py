"""`ncfix doctor`: describes the installation on this computer, and what is wrong with it."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path

import click

from ncfix import core, host
from ncfix.cli import console
from ncfix.cli.options import json_option
from ncfix.diagnostics import ExitCode, NcfixError, visible
from ncfix.plugins import load_plugins
from ncfix.values import frozen
from ncfix.version import __version__

EXTRAS = {
    "sympy": ("symbolic", "`ncfix derive` does not work"),
    "watchfiles": ("watch", "`ncfix watch` looks at the folder once a second"),
    "distributed": ("cluster", "`--executor dask://HOST:PORT` does not work"),
    "plotly": ("report", "no pages of programs (`--report`)"),
    "matplotlib": ("plot", "no pictures (`--plot`)"),
}
"""Optional packages: package -> its extra, and the consequence of its absence."""
NEEDS = re.compile(r"([A-Za-z0-9_.-]+)(?:[^;]*?>=\s*([0-9.]+))?[^;]*(;.*\bextra\b)?")
"""A requirement: package, minimum version, and a third group if only an extra needs it."""
OLDEST_PYTHON = (3, 11)


@frozen
class HostFinding:
    """One item of the examination.

    what   the item
    found  its state
    wrong  what to do about it; empty if it is in order
    """

    what: str
    found: str
    wrong: str = ""


def findings() -> Iterator[HostFinding]:
    """All items, in order."""
    yield HostFinding("ncfix", f"{__version__}, {Path(__file__).parents[1]}")
    python = f"{platform.python_version()}, {sys.executable}"
    yield HostFinding("Python", python, "" if sys.version_info >= OLDEST_PYTHON else "ncfix needs 3.11 or later")
    yield HostFinding("computer", f"{platform.platform()}, {console.counted(host.processors(), 'processor')} available")
    yield from packages(_requirements(), _version)
    stale = core.fault() and core.has_binary()  # it is not of these sources
    yield HostFinding("core", core.status(), core.fault() if stale else "")
    yield from _plugins()
    yield from _caches()
    yield _temporary()
    yield _outputs()
    settings = sorted(name for name in os.environ if name.startswith("NCFIX_"))
    yield HostFinding("environment", ", ".join(f"{name}={os.environ[name]}" for name in settings) or "no NCFIX_...")


def packages(requirements: Iterable[str], version_of: Callable[[str], str | None]) -> Iterator[HostFinding]:
    """The packages that ncfix needs, and those of its extras.

    version_of  the installed version of a package, None for none
    """
    least: dict[str, str] = {}
    for line in requirements:
        found = NEEDS.match(line)
        if found and not found[3]:
            least[found[1]] = found[2] or ""
    for name, wanted in least.items():
        there = version_of(name)
        if there is None:
            yield HostFinding(name, "not installed", f"pip install '{name}{f'>={wanted}' if wanted else ''}'")
        elif _numbers(there) < _numbers(wanted):
            yield HostFinding(name, there, f"ncfix needs {wanted} or later")
        else:
            yield HostFinding(name, there)
    for name, (extra, without) in EXTRAS.items():
        there = version_of(name)
        yield HostFinding(name, there or f"not installed (extra {extra}): {without}")


def _requirements() -> list[str]:
    try:
        return metadata("ncfix").get_all("Requires-Dist") or []
    except PackageNotFoundError:
        return []


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])


def _plugins() -> Iterator[HostFinding]:
    found = load_plugins()
    for plugin in found.loaded:
        adds = "; ".join(f"{kind}: {', '.join(things)}" for kind, things in plugin.things.items() if things)
        yield HostFinding(f"plugin {plugin.name}", f"{plugin.distribution} {plugin.version}: {adds}".strip())
    for problem in found.problems:
        yield HostFinding("plugin", problem.text, f"{problem.code}: {problem.advice}")


def _caches() -> Iterator[HostFinding]:
    """The folders for cached grammars; the first writable one is used."""
    writable = False
    for folder in host.cache_folders(str(Path(__file__).parents[1] / "text" / "grammar.py")):
        can = _writable(folder)
        writable = writable or can
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else 0
        state = "writable" if can else "not writable"
        yield HostFinding("cache", f"{folder}, {size / 1e6:.1f} MB, {state}")
    if not writable:
        yield HostFinding(
            "caches", "none is writable", "make one of these folders writable; until then ncfix starts more slowly"
        )


def _writable(folder: Path) -> bool:
    """Whether a folder can be written to, or created."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK)


def _temporary() -> HostFinding:
    folder = tempfile.gettempdir()
    room = _room(folder)
    wrong = (
        ""
        if room is None or room > 1 << 30
        else "make room, or set TMPDIR to another folder: long programs from pipes are stored there"
    )
    return HostFinding("temporary files", folder + ("" if room is None else f", {room / 1e9:.1f} GB free"), wrong)


def _room(folder: str) -> int | None:
    try:
        found = os.statvfs(folder)
    except (OSError, AttributeError):
        return None
    return found.f_bavail * found.f_frsize


def _outputs() -> HostFinding:
    """How files are written in the working folder."""
    try:
        with tempfile.TemporaryDirectory(prefix=".ncfix-doctor-", dir=os.curdir) as folder:
            path = os.path.join(folder, "whole")
            from ncfix.files import append, write_whole

            write_whole(path, b"whole\n")
            append(path, b"and more\n")
            unnamed = hasattr(os, "O_TMPFILE") and _has_unnamed(folder)
    except OSError as error:
        return HostFinding("working folder", f"not writable: {error.strerror}")
    except NcfixError as error:
        return HostFinding(
            "working folder", f"{visible(os.getcwd())}: {error.messages[0].text}", error.messages[0].advice
        )
    how = "" if unnamed else ", at first under the name .ncfix-*.tmp"
    return HostFinding(
        "working folder", f"{visible(os.getcwd())}: writable; an output appears only when it is complete{how}"
    )


def _has_unnamed(folder: str) -> bool:
    try:
        os.close(os.open(folder, os.O_RDWR | os.O_TMPFILE, 0o600))
    except OSError:
        return False
    return True


@click.command()
@json_option
def doctor(as_json: bool) -> int:
    """Check the installation: packages, plugins, the compiled core, caches.

    Exit code 1: something is wrong.
    """
    found = list(findings())
    if as_json:
        console.put_json(findings=[{"what": each.what, "found": each.found, "wrong": each.wrong} for each in found])
    else:
        wide = max(len(each.what) for each in found)
        for each in found:
            console.put(f"{each.what:<{wide}}  {each.found}\n")
            if each.wrong:
                console.put(f"{'':<{wide}}  WRONG: {each.wrong}\n")
    return ExitCode.FINDINGS if any(each.wrong for each in found) else ExitCode.DONE
