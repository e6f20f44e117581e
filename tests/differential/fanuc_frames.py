"""What codes of Fanuc do to coordinates, as plain matrices, for judging: G10, G51, G51.1, G52, G68, G68.2, G92.

Source: Fanuc 30i operator's manual (machining centre).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from differential.errors import LETTERS
from differential.sinumerik_frames import PLANES, Floats, Frame, about

if TYPE_CHECKING:
    from differential.fanuc import Control


def vector_of(control: Control, words: dict[str, float], default: Floats) -> Floats:
    """X Y Z of a block, mm."""
    given = [words[letter] * control.modes["unit"] if letter in words else math.nan for letter in "XYZ"]
    return np.where(np.isnan(given), default, given)


def local(control: Control, words: dict[str, float]) -> None:
    """G52."""
    control.local = vector_of(control, words, control.local)


def preset(control: Control, words: dict[str, float]) -> None:
    """G92: where it stands is called by the words; G52 goes along them."""
    named = np.array([letter in words for letter in "XYZ"])
    position = (control.base - control.settable.shift) - control.shift - control.local
    wanted = vector_of(control, words, position)
    control.shift = np.where(named, control.shift + control.local + position - wanted, control.shift)
    control.local = np.where(named, 0.0, control.local)


def rotation(control: Control, words: dict[str, float]) -> None:
    """G68: about a point of the plane."""
    first, second, across = PLANES[control.modes["plane"]]
    centre = control.frame.back(control.base)
    for index in (first, second):
        centre[index] = words.get("XYZ"[index], centre[index]) * control.modes["unit"]
    centre[across] = 0.0
    turn = about(across, words["R"])
    control.program = Frame(turn, centre - turn @ centre)


def plane(control: Control, words: dict[str, float]) -> None:
    """G68.2 in its forms."""
    form, number = int(words.get("P", 0)), int(words.get("Q", 0))
    if form in (2, 3):
        control.points[number] = words
        if number < (3 if form == 2 else 2):
            return
    origin = vector_of(control, control.points[1] if form in (2, 3) else words, np.zeros(3))
    if form == 0:
        turn = about(2, words.get("I", 0)) @ about(0, words.get("J", 0)) @ about(2, words.get("K", 0))
    elif form == 1:
        turn = np.eye(3)
        for axis in str(number or 123):
            turn = about(int(axis) - 1, words.get("IJK"[int(axis) - 1], 0)) @ turn
    elif form == 2:
        p = [vector_of(control, control.points[n], np.zeros(3)) for n in (1, 2, 3)]
        turn = axes_of(p[1] - p[0], np.cross(p[1] - p[0], p[2] - p[0]))
        turn = turn @ about(2, control.points.get(0, {}).get("R", 0.0))
    else:
        x, z = ([control.points[n].get(letter, 0.0) for letter in "IJK"] for n in (1, 2))
        turn = axes_of(np.array(x), np.array(z))
    control.points = {}
    q = control.axes(control.base[None], control.rotary())[0]
    control.modes["tcp"] = control.modes["tilted"] = True
    control.base = control.base_of(q)
    control.swivel = Frame(turn, origin)


def axes_of(x: Floats, z: Floats) -> Floats:
    """The turn with Z along one vector, and X along another but for what is not square."""
    z = z / np.linalg.norm(z)
    y = np.cross(z, x)
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=-1)


def no_turn(control: Control, words: dict[str, float]) -> None:
    """G69."""
    control.program = Frame()
    if control.modes.get("tilted"):
        q = control.axes(control.base[None], control.rotary())[0]
        control.modes["tilted"], control.modes["tcp"] = False, control.codes.get("tip", False)
        control.swivel, control.base = Frame(), control.base_of(q)


def square(control: Control, words: dict[str, float]) -> None:
    """G53.1: the rotary axes turn, the linear ones stand."""
    q = control.axes(control.base[None], control.rotary())[0]
    control.turned = control.ways(control.frame.turn[:, 2])[0]
    for letter, degrees in control.turned.items():
        q[LETTERS.index(letter)] = degrees
    control.base = control.base_of(q)


def mirror(control: Control, words: dict[str, float]) -> None:
    """G51.1."""
    control.mirrors |= {"XYZ".index(letter): value * control.modes["unit"] for letter, value in words.items()}


def no_mirror(control: Control, words: dict[str, float]) -> None:
    """G50.1."""
    for letter in words:
        control.mirrors.pop("XYZ".index(letter), None)


def scale(control: Control, words: dict[str, float]) -> None:
    """G51."""
    control.scaled = vector_of(control, words, control.here()), words["P"]


def no_scale(control: Control, words: dict[str, float]) -> None:
    """G50."""
    control.scaled = None


def data(control: Control, words: dict[str, float]) -> None:
    """G10 L2, L20 and L10."""
    kind, number, unit = int(words["L"]), int(words["P"]), control.modes["unit"]
    if kind == 10:
        control.tools = control.tools | {number: words["R"] * unit}
        return
    table, key = (control.offsets, 53 + number) if kind == 2 else (control.extended, number)
    before = np.array(table.get(key, (0.0, 0.0, 0.0)))
    base = before if control.modes["inc"] else 0.0
    x, y, z = (vector_of(control, words, before - base) + base).tolist()
    table = dict(table) | {key: (x, y, z)}
    if kind == 2:
        control.offsets = table
    else:
        control.extended = table
    control.settable = control.system(control.codes["system"])


SETTING = {
    52.0: local,
    92.0: preset,
    68.0: rotation,
    68.2: plane,
    69.0: no_turn,
    53.1: square,
    51.1: mirror,
    50.1: no_mirror,
    51.0: scale,
    50.0: no_scale,
    10.0: data,
}
