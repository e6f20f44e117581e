"""Routes as programs of SINUMERIK."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from metamorphic.harness import LENGTH, SETUP, Route, Step
from metamorphic.iso_writers import ORIGIN, tip_words, turn, words
from ncfix.compensate.following import with_workpiece
from ncfix.machine import Machine

HEAD = "G710 G17 G40 G90 G94\nT1 D1 M6\nG54\n"
TAIL = "M30\n"


def full(path: Route) -> str:
    """Every word in every block."""
    lines = [f"G{path[0].code} {words(path[0], path[0])} F500"]
    lines += [f"G{step.code} {words(step, before)} F500" for before, step in itertools.pairwise(path)]
    return HEAD + "\n".join(lines) + "\n" + TAIL


def changed(path: Route) -> str:
    """Coordinates only where they change."""
    lines, before = [], None
    for step in path:
        parts = [f"G{step.code}"]
        for letter in "XYZ":
            value = getattr(step, letter.lower())
            if before is None or value != getattr(before, letter.lower()):
                parts.append(f"{letter}{value:.3f}")
        if step.code > 1:
            assert before is not None
            parts += [f"I{step.centre[0] - before.x:.3f}", f"J{step.centre[1] - before.y:.3f}"]
        lines.append(" ".join(parts))
        before = step
    return HEAD + "F500\n" + "\n".join(lines) + "\n" + TAIL


def increments(path: Route) -> str:
    """G91 after the first motion."""
    lines = [f"G{path[0].code} {words(path[0], path[0])}", "G91 F500"]
    lines += [f"G{step.code} {increment(before, step)}" for before, step in itertools.pairwise(path)]
    return HEAD + "\n".join(lines) + "\n" + TAIL


def increment(before: Step, step: Step, form: str = "{}{:.3f}") -> str:
    """The coordinates of a step as increments."""
    steps = ((letter, getattr(step, letter.lower()) - getattr(before, letter.lower())) for letter in "XYZ")
    text = " ".join(form.format(letter, value) for letter, value in steps)
    if step.code > 1:
        text += f" I{step.centre[0] - before.x:.3f} J{step.centre[1] - before.y:.3f}"
    return text


def by_word(path: Route) -> str:
    """IC in G90, word by word."""
    lines = [f"G{path[0].code} {words(path[0], path[0])} F500"]
    lines += [f"G{step.code} {increment(before, step, '{}=IC({:.3f})')}" for before, step in itertools.pairwise(path)]
    return HEAD + "\n".join(lines) + "\n" + TAIL


def absolute_in_g91(path: Route) -> str:
    """AC in G91."""
    text = re.sub(r"([XYZ])(-?[\d.]+)", r"\1=AC(\2)", full(path))
    return text.replace("G90", "G91")


def radii(path: Route) -> str:
    """Arcs by CR."""
    return re.sub(r"I(-?[\d.]+) J(-?[\d.]+)", lambda m: f"CR={np.hypot(float(m[1]), float(m[2])):.3f}", full(path))


def centres(path: Route) -> str:
    """Arcs with absolute centres."""
    lines = full(path).splitlines()
    start = len(HEAD.splitlines())
    for place, step in enumerate(path, start):
        if step.code > 1:
            centre = f"I=AC({step.centre[0]:.3f}) J=AC({step.centre[1]:.3f})"
            lines[place] = re.sub(r"I-?[\d.]+ J-?[\d.]+", centre, lines[place])
    return "\n".join(lines) + "\n"


def polar(path: Route) -> str:
    """Angle and radius, both in every block: about a pole of its own for each arc, else about the last one."""
    return polar_words(path, sparing=False)


def sparing_polar(path: Route) -> str:
    """Angle and radius, those left out that are as they were."""
    return polar_words(path, sparing=True)


def polar_words(path: Route, *, sparing: bool) -> str:
    """A route by G111, AP and RP."""
    lines, pole, last = ["G111 X1 Y2"], (1.0, 2.0), ("", "")
    for step in path:
        if step.code > 1 and step.centre != pole:
            pole, last = step.centre, ("", "")
            lines.append(f"G111 X{pole[0]:.3f} Y{pole[1]:.3f}")
        across, up = step.x - pole[0], step.y - pole[1]
        now = f"AP={np.degrees(np.arctan2(up, across)):.8f}", f"RP={np.hypot(across, up):.7f}"
        written = [word for word, before in zip(now, last, strict=True) if not sparing or word != before] or now[:1]
        lines.append(f"G{step.code} {' '.join(written)} Z{step.z:.3f} F500")
        last = now
    return HEAD + "\n".join(lines) + "\n" + TAIL


def tangents(path: Route) -> str:
    """A line, and arcs that each go on where the one before ended (CT), through the points of the route."""
    points = flat(path)
    lines = [f"CT X{x:.3f} Y{y:.3f}" for x, y in points[2:]]
    return HEAD + "\n".join(begun(points, path[0].z) + lines) + "\n" + TAIL


def tangents_by_centre(path: Route) -> str:
    """The same arcs by their centres."""
    points = flat(path)
    lines, ahead = [], points[1] - points[0]
    for here, there in itertools.pairwise(points[1:]):
        chord, left = there - here, np.array([-ahead[1], ahead[0]])
        away = chord @ chord / (2 * (left @ chord))
        code, (i, j) = 3 if away > 0 else 2, left * away
        lines.append(f"G{code} X{there[0]:.3f} Y{there[1]:.3f} I{i:.6f} J{j:.6f}")
        ahead = 2 * (ahead @ chord) * chord - (chord @ chord) * ahead
    return HEAD + "\n".join(begun(points, path[0].z) + lines) + "\n" + TAIL


def flat(path: Route) -> list[np.ndarray]:
    """The points of a route in XY, the first few of them, and none that makes a very large arc."""
    points = [np.array([step.x, step.y]) for step in path[:2]]
    ahead = points[1] - points[0]
    for step in path[2:7]:
        chord = np.array([step.x, step.y]) - points[-1]
        turn = abs(ahead[0] * chord[1] - ahead[1] * chord[0]) / max(np.hypot(*ahead) * np.hypot(*chord), 1e-9)
        if turn * 60 > np.hypot(*chord):
            points.append(points[-1] + chord)
            ahead = 2 * (ahead @ chord) * chord - (chord @ chord) * ahead
    return points


def begun(points: list[np.ndarray], height: float) -> list[str]:
    """The rapid to the first point, and the line to the second."""
    (x, y), (u, v) = points[:2]
    return [f"G0 X{x:.3f} Y{y:.3f} Z{height:.3f}", f"G1 X{u:.3f} Y{v:.3f} F500"]


def inches(path: Route) -> str:
    """G700."""
    text = re.sub(r"([XYZIJF])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / 25.4:.8f}", full(path))
    return text.replace("G710", "G700")


def packed(path: Route) -> str:
    """Without blanks between words."""
    return full(path).replace(" ", "")


def lower(path: Route) -> str:
    """In lower case."""
    return full(path).lower()


def numbered(path: Route) -> str:
    """With N words."""
    return "".join(f"N{10 * n} {line}\n" for n, line in enumerate(full(path).splitlines(), 1))


def equals(path: Route) -> str:
    """`X=` for X."""
    return re.sub(r"([XYZIJF])(-?[\d.]+)", r"\1=\2", full(path))


def variables(path: Route) -> str:
    """Coordinates through R parameters and expressions."""
    text = re.sub(r"([XYZ])(-?[\d.]+)", lambda m: f"{m[1]}=R1+{float(m[2]) - 1:.3f}", full(path))
    return text.replace("G54", "G54\nR1=1")


def shifted(path: Route) -> str:
    """The same in a programmed frame."""
    inner = re.sub(
        r"([XYZ])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) - {'X': 5, 'Y': -7, 'Z': 11}[m[1]]:.3f}", full(path)
    )
    return inner.replace("G54", "G54\nTRANS X5 Y-7 Z11")


def within(path: Route, frame: str, rewritten: Callable[[re.Match[str]], str]) -> str:
    """The same in a programmed frame, each word of a motion rewritten for it."""
    text = re.sub(r"\b([XYZIJG])(-?[\d.]+)", rewritten, full(path).removeprefix(HEAD).removesuffix(TAIL))
    return HEAD + frame + "\n" + text + "TRANS\n" + TAIL


def mirrored(path: Route) -> str:
    """In a mirrored frame arcs turn the other way."""
    codes = {"2": "3", "3": "2"}

    def word(found: re.Match[str]) -> str:
        if found[1] == "G":
            return "G" + codes.get(found[2], found[2])
        return f"{found[1]}{(-1 if found[1] in 'XI' else 1) * float(found[2]):.3f}"

    return within(path, "MIRROR X0", word)


def scaled(path: Route) -> str:
    """In a frame of half the size."""
    return within(
        path,
        "SCALE X0.5 Y0.5 Z0.5",
        lambda found: found[0] if found[1] == "G" else f"{found[1]}{2 * float(found[2]):.3f}",
    )


def rotated(path: Route) -> str:
    """In a frame that is turned by a right angle."""
    letters = {"X": ("Y", -1), "Y": ("X", 1), "I": ("J", -1), "J": ("I", 1), "Z": ("Z", 1)}

    def word(found: re.Match[str]) -> str:
        if found[1] == "G":
            return found[0]
        letter, sign = letters[found[1]]
        return f"{letter}{sign * float(found[2]):.3f}"

    return within(path, "ROT RPL=90", word)


# -- five axes --------------------------------------------------------------------------------------------------------


def in_axes(path: Route) -> str:
    """Without tool-centre-point control."""
    lines = [f"G{min(step.code, 1)} {words(step, step, rotary=True, places=4)} F500" for step in path]
    return HEAD + "\n".join(lines) + "\n" + TAIL


def by_tip(machine: Machine) -> Callable[[Route], str]:
    """With TRAORI and rotary words."""

    def write(path: Route) -> str:
        lines = [
            f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} A{step.a:.3f} C{step.c:.3f} F500"
            for p, step in tip_words(path, machine)
        ]
        return HEAD + "TRAORI\n" + "\n".join(lines) + "\n" + TAIL

    return write


def calm(path: Route) -> Route:
    """The route with the tool always on one side of upright, so that the nearest way of the rotary axes is its own."""
    return [replace(step, a=round(5 + abs(step.a) / 2, 1), c=round(step.c / 4, 1)) for step in path]


def by_vector(machine: Machine) -> Callable[[Route], str]:
    """With TRAORI and the direction of the tool."""

    def write(path: Route) -> str:
        lines = []
        for p, step in tip_words(path, machine):
            a, b, c = direction(machine, step)
            vector = f"A3={a:.9f} B3={b:.9f} C3={c:.9f}"
            lines.append(f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} {vector} F500")
        return HEAD + "TRAORI\nORIAXES\n" + "\n".join(lines) + "\n" + TAIL

    return write


def by_angles(machine: Machine) -> Callable[[Route], str]:
    """With TRAORI and the direction of the tool as roll-pitch-yaw angles."""

    def write(path: Route) -> str:
        lines = []
        for p, step in tip_words(path, machine):
            a, b, c = direction(machine, step)
            angles = f"A2={-np.degrees(np.arcsin(b)):.9f} B2={np.degrees(np.arctan2(a, c)):.9f}"
            lines.append(f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} {angles} F500")
        return HEAD + "TRAORI\nORIAXES\nORIRPY\n" + "\n".join(lines) + "\n" + TAIL

    return write


def direction(machine: Machine, step: Step) -> np.ndarray:
    """The direction of the tool in the workpiece."""
    q = np.zeros(len(machine.axis_names))
    q[list(machine.axis_names).index("A")], q[list(machine.axis_names).index("C")] = np.radians((step.a, step.c))
    frame = with_workpiece(machine, SETUP).nominal(q, LENGTH)
    return np.asarray(frame[:3, :3] @ np.asarray(machine.tool.direction))


TURN = (20.0, -15.0, 35.0)


def in_frame(machine: Machine) -> Callable[[Route], str]:
    """TRAORI in a turned frame (TRANS, AROT)."""

    def write(path: Route) -> str:
        rotation = turn("z", TURN[2]) @ about_y(TURN[1]) @ turn("x", TURN[0])
        lines = []
        for point, step in tip_words(path, machine):
            p = rotation.T @ (point - ORIGIN)
            lines.append(f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} A{step.a:.3f} C{step.c:.3f} F500")
        frame = "TRANS X{:.3f} Y{:.3f} Z{:.3f}\nAROT X{:.3f} Y{:.3f} Z{:.3f}\n".format(*ORIGIN, *TURN)
        return HEAD + "TRAORI\n" + frame + "\n".join(lines) + "\nTRANS\n" + TAIL

    return write


PLANE = (30.0, 20.0)


def in_plane(machine: Machine) -> Callable[[Route], str]:
    """In a plane that CYCLE800 tilts, where the tool stands square to it."""

    def write(path: Route) -> str:
        rotation = turn("x", PLANE[0]) @ about_y(PLANE[1])
        lines = []
        for step in path:
            p = rotation.T @ (np.array([step.x, step.y, step.z - 60.0]) - ORIGIN)
            lines.append(f"G{min(step.code, 1)} X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f} F500")
        tilt = 'CYCLE800(0,"T",200000,57,{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},0,0,0,0,-1)\n'.format(*ORIGIN, *PLANE)
        return HEAD + tilt + "\n".join(lines) + "\nCYCLE800()\n" + TAIL

    return write


def in_plane_by_vector(path: Route) -> str:
    """The same under TRAORI with the direction of the tool given once; the rotary axes the same way."""
    rotation = turn("x", PLANE[0]) @ about_y(PLANE[1])
    a, b, c = rotation[:, 2]
    lines = [f"G0 A3={a:.9f} B3={b:.9f} C3={c:.9f} X{path[0].x:.6f} Y{path[0].y:.6f} Z{path[0].z - 60:.6f}"]
    lines += [f"G{min(step.code, 1)} X{step.x:.6f} Y{step.y:.6f} Z{step.z - 60:.6f} F500" for step in path[1:]]
    return HEAD + "G0 A-1 C0\nTRAORI\n" + "\n".join(lines) + "\n" + TAIL


def about_y(degrees: float) -> np.ndarray:
    """The right-handed rotation about Y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
