"""Routes as Klartext programs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

from metamorphic.harness import LENGTH, Route, Step
from metamorphic.iso_writers import ORIGIN, TURN, tip_words, turn
from metamorphic.siemens_writers import direction
from ncfix.machine import Machine


def program(lines: list[str], unit: str = "MM") -> str:
    """A program of these blocks."""
    return "\n".join([f"BEGIN PGM R {unit}", "TOOL CALL 1 Z", *lines, f"END PGM R {unit}", ""])


def rate(step: Step) -> str:
    """The rate of a step."""
    return "FMAX" if step.code == 0 else "F500"


def place(step: Step) -> str:
    """Its coordinates, as low as those of the other languages, in which no tool length is in force."""
    return f"X{step.x:+.3f} Y{step.y:+.3f} Z{step.z - LENGTH:+.3f}"


def sense(step: Step) -> str:
    """Its sense of rotation."""
    return "DR-" if step.code == 2 else "DR+"


def block(step: Step) -> str:
    """One step with every word."""
    if step.code < 2:
        return f"L {place(step)} {rate(step)}"
    pole = f"CC X{step.centre[0]:+.3f} Y{step.centre[1]:+.3f}\n"
    return f"{pole}C X{step.x:+.3f} Y{step.y:+.3f} {sense(step)} F500"


def full(path: Route) -> str:
    """Every word in every block."""
    return program([block(step) for step in path])


def modal(path: Route) -> str:
    """Coordinates only where they change, F once."""
    lines = [block(path[0])]
    for before, step in itertools.pairwise(path):
        if step.code > 1:
            lines.append(block(step))
            continue
        words = [
            f"{letter}{value:+.3f}"
            for letter, value, old in (
                ("X", step.x, before.x),
                ("Y", step.y, before.y),
                ("Z", step.z - LENGTH, before.z - LENGTH),
            )
            if value != old
        ]
        lines.append(" ".join(["L", *words, rate(step)]))
    return program(lines)


def increments(path: Route) -> str:
    """IX IY IZ after the first motion; poles from the tool."""
    lines = [block(path[0])]
    for before, step in itertools.pairwise(path):
        way = f"IX{step.x - before.x:+.3f} IY{step.y - before.y:+.3f}"
        if step.code < 2:
            lines.append(f"L {way} IZ{step.z - before.z:+.3f} {rate(step)}")
        else:
            lines.append(f"CC IX{step.centre[0] - before.x:+.3f} IY{step.centre[1] - before.y:+.3f}")
            lines.append(f"C {way} {sense(step)} F500")
    return program(lines)


def radii(path: Route) -> str:
    """CR for C."""
    lines = []
    for step in path:
        radius = math.hypot(step.x - step.centre[0], step.y - step.centre[1])
        short = f"CR X{step.x:+.3f} Y{step.y:+.3f} R{radius:+.3f} {sense(step)} F500"
        lines.append(short if step.code > 1 else block(step))
    return program(lines)


def polar(path: Route) -> str:
    """LP about a pole of its own for every line, CP for arcs."""
    lines = [block(path[0])]
    for before, step in itertools.pairwise(path):
        if step.code > 1:
            sign = "-" if step.code == 2 else "+"
            lines.append(f"CC X{step.centre[0]:+.3f} Y{step.centre[1]:+.3f}\nCP IPA{sign}90 {sense(step)} F500")
            continue
        away = math.hypot(step.x - before.x, step.y - before.y)
        angle = math.degrees(math.atan2(step.y - before.y, step.x - before.x))
        lines.append(f"CC\nLP PR{away:+.9f} PA{angle:+.9f} Z{step.z - LENGTH:+.3f} {rate(step)}")
    return program(lines)


def inches(path: Route) -> str:
    """In inches."""
    scaled = [
        Step(s.code, s.x / 25.4, s.y / 25.4, (s.z - LENGTH) / 25.4, (s.centre[0] / 25.4, s.centre[1] / 25.4))
        for s in path
    ]
    lines = []
    for step in scaled:
        ends = f"X{step.x:+.8f} Y{step.y:+.8f}"
        if step.code < 2:
            lines.append(f"L {ends} Z{step.z:+.8f} {rate(step)}")
        else:
            lines.append(f"CC X{step.centre[0]:+.8f} Y{step.centre[1]:+.8f}\nC {ends} {sense(step)} F500")
    return program(lines, "INCH")


def numbered(path: Route) -> str:
    """With irregular block numbers."""
    return "".join(f"{17 * n % 90:03d} {line}\n" for n, line in enumerate(full(path).splitlines()))


def with_commas(path: Route) -> str:
    """With decimal commas."""
    return full(path).replace(".", ",")


def formulas(path: Route) -> str:
    """With Q parameters for X."""
    lines = []
    for n, step in enumerate(path):
        lines.append(f"Q{n + 1} = 2 * {step.x / 2:.3f}")
        lines.append(block(step).replace(f"X{step.x:+.3f}", f"X+Q{n + 1}", 1) if step.code < 2 else block(step))
    return program(lines)


def in_axes(path: Route) -> str:
    """Five axes without tool-centre-point control."""
    lines = [f"L X{s.x:+.3f} Y{s.y:+.3f} Z{s.z:+.3f} A{s.a:+.3f} C{s.c:+.3f} {rate(s)}" for s in path]
    return program(lines)


def tips(machine: Machine, path: Route) -> list[tuple[str, Step]]:
    """Tool-tip coordinates of a route."""
    return [(f"X{p[0]:+.6f} Y{p[1]:+.6f} Z{p[2]:+.6f}", step) for p, step in tip_words(path, machine)]


def by_tip(machine: Machine) -> Callable[[Route], str]:
    """With M128."""

    def write(path: Route) -> str:
        lines = [f"L {words} A{step.a:+.3f} C{step.c:+.3f} {rate(step)}" for words, step in tips(machine, path)]
        return program(["M128", *lines])

    return write


def by_function(machine: Machine) -> Callable[[Route], str]:
    """With FUNCTION TCPM."""
    return lambda path: by_tip(machine)(path).replace("M128", "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS")


def by_vector(machine: Machine) -> Callable[[Route], str]:
    """With M128 and the direction of the tool."""

    def write(path: Route) -> str:
        lines = []
        for words, step in tips(machine, path):
            a, b, c = direction(machine, step)
            lines.append(f"LN {words} TX{a:+.9f} TY{b:+.9f} TZ{c:+.9f} {rate(step)}")
        return program(["M128", *lines])

    return write


def in_plane(machine: Machine) -> Callable[[Route], str]:
    """With M128 in a tilted plane."""

    def write(path: Route) -> str:
        rotation = turn("z", TURN[0]) @ turn("x", TURN[1]) @ turn("z", TURN[2])
        lines = []
        for point, step in tip_words(path, machine):
            x, y, z = rotation.T @ (point - ORIGIN)
            lines.append(f"L X{x:+.6f} Y{y:+.6f} Z{z:+.6f} A{step.a:+.3f} C{step.c:+.3f} {rate(step)}")
        frame = "TRANS DATUM AXIS X{:+.3f} Y{:+.3f} Z{:+.3f}".format(*ORIGIN)
        plane = "PLANE EULER EULPR{:+.3f} EULNU{:+.3f} EULROT{:+.3f} STAY".format(*TURN)
        return program(["M128", frame, plane, *lines])

    return write
