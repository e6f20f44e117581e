"""Machines and poses for the tests of measurements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ncfix.machine import Machine, load
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.measurement import Measurement

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "machines"
NAMES = ("three_axis", "wCBXFZYSt", "wCAYFXZSt", "dmu50")
TARGETS = (("target", "1 100 0 50"), ("target", "2 -50 80 0"), ("target", "3 -50 -80 -50"))


def machine(name: str) -> Machine:
    return load(str(EXAMPLES / f"{name}.toml"))


def perfect(known: Machine) -> Machine:
    """The same machine with all coefficients at zero."""
    return known.replace(effects=tuple(replace(e, coefficients=(0.0,) * e.basis.size) for e in known.effects))


def plan(known: Machine, kind: str, count: int, seed: int = 0) -> Measurement:
    """Poses all over the travels, for any kind: tcp, tcp6, probe, gauge, bar, tool, table, axis."""
    random = np.random.default_rng(seed)
    room = Room(tool_lengths=(120.0, 200.0))
    if kind in ("tcp", "tcp6"):
        return candidates(known, kind, count, room, seed)
    if kind == "probe":
        return candidates(known, kind, 3 * count, room, seed).rows(slice(count))
    if kind == "gauge":
        return candidates(known, "length", count, room, seed)
    every = candidates(known, "tcp", count, room, seed)
    if kind == "bar":
        tip = known.tip(every.positions(known), every.column("tool_length"))
        centre = tip.mean(axis=0) + np.array([50.0, -30.0, 20.0])
        columns = {f"c{axis}": np.full(count, centre[k]) for k, axis in enumerate("xyz")}
        columns["radius"] = np.linalg.norm(tip - centre, axis=1)
        return Measurement("length", (), {**every.columns, **columns}, every.labels)
    if kind in ("tool", "table"):
        side = "tool" if kind == "tool" else "workpiece"
        labels = {"target": tuple(random.choice(["1", "2", "3"], count).tolist()), "set": ("1",) * count}
        return Measurement("points", (*TARGETS, ("carried_by", side)), every.columns, labels)
    return _direct(known, every, random)


def _direct(known: Machine, every: Measurement, random: np.random.Generator) -> Measurement:
    names = sorted({e.name for e in known.effects if not e.location and e.joint in known.axis_names})
    component = random.choice(names, len(every)).tolist()
    labels = {"axis": tuple(name[2] for name in component), "component": tuple(component), "set": ("1",) * len(every)}
    position = np.array([every.columns[name[2]][row] for row, name in enumerate(component)])
    columns = {"position": position, "direction": random.choice([-1.0, 1.0], len(every))}
    return Measurement("axis", (), columns, labels)
