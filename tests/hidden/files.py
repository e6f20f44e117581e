"""The measurement files as docs/formats.md section 3 states them. Nothing in them tells what is hidden."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from .climate import BODIES
from .motion import Array, Ints
from .situation import Situation

HEADS = {"tcp": ("dx", "dy", "dz"), "probe": ("mx", "my", "mz"), "length": ("length",)}


def measurement(
    s: Situation,
    kind: str,
    values: Array,
    noise_um: float | None = None,
    distances: tuple[str, ...] = (),
    factors: Mapping[str, float] = MappingProxyType({}),
) -> str:
    """One file: comment header, column names, a row a measurement. `values` (n, 3), or (n, 1) for lengths, mm.

    Positions have four decimals (mm, degree), measured values five. `factors` puts columns into a wrong unit on
    purpose; a factor of X is one of mx too.
    """
    columns = _state(s, kind)
    columns |= {name: [f"{v:.5f}" for v in values[:, i]] for i, name in enumerate(HEADS[kind])}
    for name, factor in factors.items():
        for column in {name, f"m{name.lower()}"} & set(columns):
            columns[column] = [f"{factor * float(v):.6f}" for v in columns[column]]
    return "\n".join([*_header(kind, noise_um, distances), *_rows(columns), ""])


def plan(s: Situation) -> str:
    """The commanded states only: what a simulation is asked for, without a set-up that could be off."""
    return "\n".join([*_header("tcp", None, ()), "# setup: none", *_rows(_state(s, "tcp")), ""])


def _header(kind: str, noise_um: float | None, distances: tuple[str, ...]) -> list[str]:
    noise = [] if noise_um is None else [f"# noise_um: {noise_um:g}"]
    known = [f"# distance: {text}" for text in distances]
    return ["# ncfix-measurement: 1", f"# kind: {kind}", *noise, *known]


def _rows(columns: dict[str, list[str]]) -> list[str]:
    return [",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True))]


def _state(s: Situation, kind: str) -> dict[str, list[str]]:
    """Everything but the measured values, by column name."""
    columns = {"ball": _whole(s.set_id // 2 + 1)} if kind == "probe" else {"set": _whole(s.set_id + 1)}
    for i, joint in enumerate(s.machine.joints):
        if joint.rotary or kind != "probe":
            columns[joint.name] = [f"{v:.4f}" for v in s.q[:, i] / joint.unit]
    columns |= {f"dir_{name}": _whole(s.moving(name)) for name in s.machine.axes}
    columns["time_s"] = [f"{v:.1f}" for v in s.time]
    columns |= {f"temp_{body}": [f"{v:.2f}" for v in s.climate.sensor(body, s.time)] for body in BODIES}
    columns["load_kg"] = [f"{v:g}" for v in s.load]
    columns["tool_length"] = [f"{v:g}" for v in s.length]
    columns["repeat"] = _whole(s.repeat)
    if kind == "length":
        columns |= {f"c{letter}": [f"{v:.4f}" for v in s.centre[:, i]] for i, letter in enumerate("xyz")}
        columns["radius"] = [f"{v:g}" for v in s.radius]
    return columns


def _whole(values: Array | Ints) -> list[str]:
    return [str(int(v)) for v in np.asarray(values)]


def read(text: str) -> dict[str, Array]:
    """The columns of a measurement file, numbers only, by name; comment lines are skipped."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return {name: values[:, i] for i, name in enumerate(lines[0].split(","))}
