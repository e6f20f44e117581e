"""Routes as programs of the RS274 and Fanuc families."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from metamorphic.harness import LENGTH, SETUP, Route, Step
from ncfix.compensate.following import with_workpiece
from ncfix.compensate.plan.kinematics import commands_from_joints
from ncfix.machine import Machine

HEAD = "G21 G17 G40 G49 G80 G90 G94\nG54\n"
TAIL = "M30\n"


def words(step: Step, before: Step, rotary: bool = False, places: int = 3) -> str:
    """The coordinates of a step."""
    text = f"X{step.x:.{places}f} Y{step.y:.{places}f} Z{step.z:.{places}f}"
    if rotary:
        text += f" A{step.a:.3f} C{step.c:.3f}"
    if step.code > 1:
        text += f" I{step.centre[0] - before.x:.{places}f} J{step.centre[1] - before.y:.{places}f}"
    return text


def full(path: Route) -> str:
    """Every word in every block."""
    lines = [f"G{path[0].code} {words(path[0], path[0])} F500."]
    lines += [f"G{step.code} {words(step, before)} F500." for before, step in itertools.pairwise(path)]
    return HEAD + "\n".join(lines) + "\n" + TAIL


def modal(path: Route) -> str:
    """Codes and coordinates only where they change."""
    lines, before, code = [], None, -1
    for step in path:
        parts = [f"G{step.code}"] if step.code != code else []
        for letter in "XYZ":
            value = getattr(step, letter.lower())
            if before is None or value != getattr(before, letter.lower()) or (step.code > 1 and letter != "Z"):
                parts.append(f"{letter}{value:.3f}")
        if step.code > 1:
            assert before is not None
            parts += [f"I{step.centre[0] - before.x:.3f}", f"J{step.centre[1] - before.y:.3f}"]
        lines.append(" ".join(parts) or "(nothing)")
        before, code = step, step.code
    return HEAD + "F500.\n" + "\n".join(lines) + "\n" + TAIL


def increments(path: Route) -> str:
    """G91 after the first motion."""
    lines = [f"G{path[0].code} {words(path[0], path[0])}", "G91 F500."]
    for before, step in itertools.pairwise(path):
        text = f"X{step.x - before.x:.3f} Y{step.y - before.y:.3f} Z{step.z - before.z:.3f}"
        if step.code > 1:
            text += f" I{step.centre[0] - before.x:.3f} J{step.centre[1] - before.y:.3f}"
        lines.append(f"G{step.code} {text}")
    return HEAD + "\n".join(lines) + "\n" + TAIL


def radii(path: Route) -> str:
    """Arcs by R."""
    return re.sub(r"I(-?[\d.]+) J(-?[\d.]+)", lambda m: f"R{np.hypot(float(m[1]), float(m[2])):.3f}", full(path))


def inches(path: Route) -> str:
    """G20."""
    text = re.sub(r"([XYZIJF])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / 25.4:.8f}", full(path))
    return text.replace("G21", "G20")


def packed(path: Route) -> str:
    """Without blanks."""
    return full(path).replace(" ", "")


def lower(path: Route) -> str:
    """In lower case."""
    return full(path).lower()


def numbered(path: Route) -> str:
    """With N words."""
    return "".join(f"N{10 * n} {line}\n" for n, line in enumerate(full(path).splitlines(), 1))


def pointless(path: Route) -> str:
    """Coordinates as whole numbers of least increments (IS-B)."""
    return re.sub(r"([XYZIJ])(-?[\d.]+)", lambda m: f"{m[1]}{round(float(m[2]) * 1000)}", full(path))


def macro(path: Route) -> str:
    """Coordinates through variables and expressions."""
    return re.sub(r"([XYZ])(-?[\d.]+)", lambda m: f"{m[1]}[{float(m[2]) - 1:.3f}+1.]", full(path))


def mirrored(path: Route) -> str:
    """In coordinates that are mirrored at X = 10 (G51.1)."""
    image = [replace(s, x=20 - s.x, centre=(20 - s.centre[0], s.centre[1]), code=(0, 1, 3, 2)[s.code]) for s in path]
    return full(image).replace(HEAD, HEAD + "G51.1 X10.\n").replace(TAIL, "G50.1 X0\n" + TAIL)


# -- five axes --------------------------------------------------------------------------------------------------------


def positions(path: Route, machine: Machine) -> np.ndarray:
    """Axis positions of a route in machine axes of the machine, mm and rad; offsets and tool length in them."""
    letters = {name: "a" if name == tilting(machine) else name.lower() for name in machine.axis_names}
    q = np.array([[getattr(step, letters[name]) for name in machine.axis_names] for step in path])
    q[:, list(machine.axis_names).index("Z")] += 60.0 + LENGTH
    return np.where(machine.rotary, np.radians(q), q)


def tilting(machine: Machine) -> str:
    """The rotary axis beside C."""
    return next(axis.name for axis in machine.axes if axis.rotary and axis.name != "C")


def in_axes(machine: Machine):
    """Without tool-centre-point control."""

    def write(path: Route) -> str:
        lines = [f"G{min(step.code, 1)} {words(step, step, rotary=True, places=4)} F500." for step in path]
        text = "\n".join(lines).replace(" A", f" {tilting(machine)}")
        return HEAD + "G43 H1\n" + text + "\n" + TAIL

    return write


def tip_words(path: Route, machine: Machine) -> list[tuple[np.ndarray, Step]]:
    """X Y Z of the tip in the workpiece for each step, program coordinates, mm."""
    q = positions(path, machine)
    on = np.ones(len(q), dtype=bool)
    commands = commands_from_joints(with_workpiece(machine, SETUP), q, on, np.full(len(q), LENGTH))
    columns = [list(machine.axis_names).index(letter) for letter in "XYZ"]
    return list(zip(commands[:, columns] - np.array([0.0, 0.0, 60.0]), path, strict=True))


def by_tip(machine: Machine):
    """With tool-centre-point control (G43.4)."""
    tilt = tilting(machine)

    def write(path: Route) -> str:
        lines = [
            f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} {tilt}{step.a:.3f} C{step.c:.3f} F500."
            for p, step in tip_words(path, machine)
        ]
        return HEAD + "G43.4 H1\n" + "\n".join(lines) + "\n" + TAIL

    return write


def steady(path: Route) -> Route:
    """The same places with the tool always tilted to one side: there is one way to it, and it is the nearest."""
    return [replace(step, a=round(10.0 + abs(step.a) / 2, 3), c=round(step.c / 3, 3)) for step in path]


def by_direction(machine: Machine):
    """With tool-centre-point control, and the direction of the tool as a vector (G43.5)."""

    def write(path: Route) -> str:
        path = steady(path)
        q = positions(path, machine)
        ways = machine.tip(q, 0.0) - machine.tip(q, 100.0)
        first = f"G0 {tilting(machine)}{path[0].a:.3f} C{path[0].c:.3f}\n"
        lines = [
            f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} I{v[0]:.7f} J{v[1]:.7f} K{v[2]:.7f} F500."
            for (p, step), v in zip(tip_words(path, machine), ways, strict=True)
        ]
        return HEAD + first + "G43.5 H1\n" + "\n".join(lines) + "\n" + TAIL

    return write


def by_angles(machine: Machine):
    """The same with rotary words (G43.4)."""
    tips = by_tip(machine)

    def write(path: Route) -> str:
        path = steady(path)
        first = f"G0 {tilting(machine)}{path[0].a:.3f} C{path[0].c:.3f}\n"
        return tips(path).replace("G43.4 H1\n", first + "G43.4 H1\n")

    return write


TURN = (20.0, 30.0, -10.0)
ORIGIN = np.array([12.0, -7.5, 3.0])


def as_angles(rotation: np.ndarray) -> str:
    """The plane by Euler angles."""
    return "G68.2 X{:.3f} Y{:.3f} Z{:.3f} I{:.3f} J{:.3f} K{:.3f}\n".format(*ORIGIN, *TURN)


def as_points(rotation: np.ndarray) -> str:
    """The plane by three points, the frame of which is turned once more about Z."""
    x, y, _ = (rotation @ turn("z", -25.0)).T
    points = (ORIGIN, ORIGIN + 40.0 * x, ORIGIN + 30.0 * y - 20.0 * x)
    lines = [f"G68.2 P2 Q{n} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f}\n" for n, p in enumerate(points, 1)]
    return "G68.2 P2 Q0 X0 Y0 Z0 R25.\n" + "".join(lines)


def as_vectors(rotation: np.ndarray) -> str:
    """The plane by two vectors."""
    x, _, z = rotation.T
    origin = "X{:.3f} Y{:.3f} Z{:.3f}".format(*ORIGIN)
    vectors = ["I{:.8f} J{:.8f} K{:.8f}".format(*(3.0 * v)) for v in (x, z)]
    return f"G68.2 P3 Q1 {origin} {vectors[0]}\nG68.2 P3 Q2 {vectors[1]}\n"


def in_plane(machine: Machine, said: Callable[[np.ndarray], str] = as_angles):
    """The same in a tilted plane (G68.2), with the tip led (G43.4)."""
    tilt = tilting(machine)

    def write(path: Route) -> str:
        rotation = turn("z", TURN[0]) @ turn("x", TURN[1]) @ turn("z", TURN[2])
        lines = []
        for point, step in tip_words(path, machine):
            p = rotation.T @ (point - ORIGIN)
            lines.append(
                f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} {tilt}{step.a:.3f} C{step.c:.3f} F500."
            )
        return HEAD + said(rotation) + "G43.4 H1\n" + "\n".join(lines) + "\nG69\nG49\n" + TAIL

    return write


def turn(axis: str, degrees: float) -> np.ndarray:
    """The right-handed rotation about X or Z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
