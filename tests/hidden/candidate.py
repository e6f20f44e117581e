"""The code under test, as a program of its own or as a callable: it is given files and gives an answer."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from . import files
from .motion import Array


@dataclass(frozen=True, slots=True)
class Reported:
    """One named effect of an answer."""

    name: str
    title: str = ""
    axis: str | None = None
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """What `diagnose --json` said; `error` is why it said nothing. `machine` is the file with the effects added, if
    any; `seconds` went by, `cpu_seconds` of them were worked (a busy computer takes longer than it works).
    """

    verdict: str = ""
    effects: tuple[Reported, ...] = ()
    unknown_um: float = 0.0
    next_poses: tuple[Mapping[str, float], ...] = ()
    machine: Path | None = None
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    error: str = ""
    raw: Mapping[str, Any] = field(default_factory=dict)


class Candidate(Protocol):
    """What the scorer needs. Both calls may raise; the scorer counts that as no answer."""

    def diagnose(
        self, machine: Path, measured: Sequence[Path], output: Path, without: Sequence[str]
    ) -> Mapping[str, Any]:
        """The JSON object of `diagnose`; the machine with what was found in `output`; `without`: names it must not
        use.
        """

    def predict(self, machine: Path, plan: Path) -> Array:
        """Tip errors (n, 3) mm of a machine file at the rows of a plan."""


@dataclass(frozen=True, slots=True)
class Program:
    """A command line as in docs/formats.md section 4. `without` is the option that takes names out of the catalogue,
    `options` are further ones of `diagnose`.
    """

    command: tuple[str, ...] = ("ncfix",)
    without: str = "--without"
    timeout: float = 120.0
    options: tuple[str, ...] = ()

    def diagnose(
        self, machine: Path, measured: Sequence[Path], output: Path, without: Sequence[str]
    ) -> Mapping[str, Any]:
        """Run `diagnose`; exit codes 0 and 1 are answers."""
        hidden = [part for name in without for part in (self.without, name)]
        hidden += self.options
        text = self._run("diagnose", *map(str, measured), "-m", str(machine), "-o", str(output), "--json", *hidden)
        result: Mapping[str, Any] = json.loads(text)
        return result

    def predict(self, machine: Path, plan: Path) -> Array:
        """Run `simulate --plan` and read the dx, dy, dz it writes."""
        output = plan.with_name("predicted.csv")
        output.unlink(missing_ok=True)
        self._run("simulate", "-m", str(machine), "--plan", str(plan), "-o", str(output))
        columns = files.read(output.read_text())
        return np.stack([columns[name] for name in ("dx", "dy", "dz")], axis=1)

    def verbs(self) -> str:
        """The help text, to see which verbs there are."""
        return self._run("--help")

    def _run(self, *arguments: str) -> str:
        done = subprocess.run(
            [*self.command, *arguments], capture_output=True, text=True, timeout=self.timeout, check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NO_COLOR": "1"},
        )  # fmt: skip
        if done.returncode not in (0, 1):
            raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-400:]}")
        return done.stdout


def load(name: str) -> Candidate:
    """The candidate that `package.module:factory` makes."""
    module, _, factory = name.partition(":")
    result: Candidate = getattr(importlib.import_module(module), factory)()
    return result


def ask(candidate: Candidate, folder: Path, without: Sequence[str] = (), more: Sequence[Path] = ()) -> Answer:
    """One question: all measurement files of a folder (and some more) against its machine file."""
    output = folder / "found.toml"
    output.unlink(missing_ok=True)
    start, worked = time.perf_counter(), cpu()
    measured = [*sorted(folder.glob("measured-*.csv")), *more]
    try:
        said = candidate.diagnose(folder / "machine.toml", measured, output, without)
    except Exception as error:
        return Answer(
            error=f"{type(error).__name__}: {error}", seconds=time.perf_counter() - start, cpu_seconds=cpu() - worked
        )
    return read_answer(said, output, time.perf_counter() - start, cpu() - worked)


def cpu() -> float:
    """Processor seconds of this process and of the programs that it has run to their end."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def read_answer(said: Mapping[str, Any], output: Path, seconds: float, cpu_seconds: float = 0.0) -> Answer:
    """The parts of the JSON object that are scored (docs/formats.md section 4)."""
    effects = tuple(
        Reported(e["name"], e.get("title") or "", e.get("axis"), tuple(e.get("aliases") or ()))
        for e in said.get("effects") or ()
    )
    unknown = said.get("unknown") or {}
    poses = tuple(_pose(item) for item in said.get("next_measurements") or ())
    machine = output if output.exists() else None
    return Answer(
        said["verdict"],
        effects,
        float(unknown.get("share_um") or 0.0),
        tuple(p for p in poses if p),
        machine,
        seconds,
        cpu_seconds,
        "",
        said,
    )


def _pose(item: Any) -> dict[str, float]:
    """The numbers of one proposed measurement, also where they are nested in `pose` or `state`."""
    if not isinstance(item, Mapping):
        return {}
    flat: dict[str, Any] = {**item, **(item.get("pose") or {}), **(item.get("state") or {})}
    return {k: float(v) for k, v in flat.items() if isinstance(v, int | float) and not isinstance(v, bool)}
