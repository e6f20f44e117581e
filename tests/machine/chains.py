"""Machines of any topology by code, with errors of any kind: material for tests of the machine floor."""

from __future__ import annotations

import numpy as np

from machine import oracle
from ncfix.machine import Axis, Effect, GaugeLine, Machine, se3
from ncfix.machine.axes import Triad
from ncfix.machine.basis import Polynomial

Rng = np.random.Generator
LETTERS = "XYZABCUVW"


def unit_vector(rng: Rng) -> tuple[float, float, float]:
    """Any direction."""
    vector = rng.normal(size=3)
    x, y, z = vector / np.linalg.norm(vector)
    return float(x), float(y), float(z)


def triad(rng: Rng) -> Triad:
    """Any right-handed triad."""
    x, y, z = ((float(a), float(b), float(c)) for a, b, c in se3.rotation(rng.normal(size=3)))
    return x, y, z


def point(rng: Rng, size: float = 200.0) -> tuple[float, float, float]:
    """Any point within a cube."""
    x, y, z = rng.uniform(-size, size, 3)
    return float(x), float(y), float(z)


def random_chain(rng: Rng, joints: int) -> Machine:
    """Skewed prismatic and revolute joints in any order on both branches, no errors."""
    on_workpiece = int(rng.integers(0, joints + 1))
    axes = tuple(
        Axis(letter, bool(rng.integers(2)), index < on_workpiece, unit_vector(rng), point(rng))
        for index, letter in enumerate(LETTERS[:joints])
    )
    names = [axis.name for axis in axes]
    topology = " ".join(["w", *names[:on_workpiece], "F", *names[on_workpiece:], "t"])
    tool = GaugeLine(unit_vector(rng), point(rng))
    return Machine("random", topology, axes, tool, workpiece_offset=point(rng))


def random_errors(rng: Rng, machine: Machine, size: float = 1.0) -> Machine:
    """All six error motions, all six location errors (some carried) of every joint: `size` times 50 um and 100 urad."""
    effects = []
    for joint in (*machine.axis_names, "S"):
        for component in "XYZABC":
            amount = size * (1e-4 if component in "ABC" else 0.05)
            reference = point(rng) if rng.random() < 0.3 else None
            carried = bool(rng.random() < 0.3)
            line = (float(amount * rng.normal()),)
            effects.append(Effect(f"E{component}0{joint}", line, reference=reference, carried=carried))
            if joint != "S":
                curve = tuple((amount * rng.normal(size=3) / 3).tolist())
                basis = Polynomial((0, 1, 2))
                effects.append(Effect(f"E{component}{joint}", curve, basis, scale=100.0, reference=reference))
    return machine.replace(effects=tuple(effects))


def near_axes(rng: Rng, machine: Machine) -> Machine:
    """Most axes along base axes, some tilted in a base plane, at most one skew: the directions that machines have."""
    axes: list[Axis] = []
    skew = rng.integers(2 * len(machine.axes))
    for index, axis in enumerate(machine.axes):
        kind = 2 if index == skew else rng.choice(2, p=[0.6, 0.4])
        plane = rng.permutation(3)
        direction = np.zeros(3)
        angle = rng.choice([np.pi / 4, 50 * np.pi / 180, 1.234])
        if kind == 0:
            direction[plane[0]] = rng.choice([-1.0, 1.0])
        else:
            direction[plane[:2]] = np.cos(angle), rng.choice([-1.0, 1.0]) * np.sin(angle)
        chosen = axis.direction if kind == 2 else tuple(direction.tolist())
        place = tuple((np.array(axis.point) * rng.integers(0, 2, 3)).tolist())
        axes.append(Axis(axis.name, axis.rotary, axis.workpiece_side, chosen, place))
    return machine.replace(axes=tuple(axes))


def a_few_errors(rng: Rng, machine: Machine, count: int = 6) -> Machine:
    """Some of all kinds of errors: motions, locations, carried, with reference points of their own."""
    full = random_errors(rng, machine).effects
    chosen = rng.choice(len(full), count, replace=False)
    return machine.replace(effects=tuple(full[int(i)] for i in sorted(chosen)))


def arguments(machine: Machine, q: np.ndarray) -> dict[str, np.ndarray]:
    """Axis positions and the values of the error functions at poses (n, n_axes), by name, for derived formulas."""
    values = {axis.name: q[:, i] for i, axis in enumerate(machine.axes)}
    for effect in machine.effects:
        place = np.zeros(len(q))
        if isinstance(effect.basis, Polynomial):
            index = machine.axis_names.index(effect.joint)
            place = np.rad2deg(q[:, index]) if machine.axes[index].rotary else q[:, index]
        values[effect.name] = np.array([oracle.value(effect, position) for position in place])
    return values


def random_positions(rng: Rng, machine: Machine, count: int) -> np.ndarray:
    """Linear axes within +-200 mm, rotary within +-180 degrees, shape (count, n_axes)."""
    reach = np.where(machine.rotary, np.pi, 200.0)
    return rng.uniform(-1, 1, (count, len(machine.axes))) * reach


def four_kinds() -> dict[str, Machine]:
    """One machine for each way of sharing two rotary axes between the branches, and one with three axes."""
    a = np.sqrt(0.5)
    axis = {
        "X": Axis("X", False, False, (1.0, 0.0, 0.0), range=(-300.0, 300.0)),
        "Y": Axis("Y", False, False, (0.0, 1.0, 0.0), range=(-300.0, 300.0)),
        "Z": Axis("Z", False, False, (0.0, 0.0, 1.0), range=(-300.0, 300.0)),
        "A": Axis("A", True, False, (1.0, 0.0, 0.0), (0.0, 10.0, 60.0)),
        "B": Axis("B", True, False, (0.0, -float(a), float(a)), (0.0, 0.0, 155.0)),
        "C": Axis("C", True, False, (0.0, 0.0, 1.0), (5.0, 0.0, 0.0)),
    }
    return {
        name: _built(name, axis) for name in ("w C B F X Y Z t", "w C F X Y Z B t", "w X F Y Z C A t", "w Y X F Z t")
    }


def _built(topology: str, axis: dict[str, Axis]) -> Machine:
    letters = topology.split()
    split = letters.index("F")
    axes = []
    for letter in letters[1:split] + letters[split + 1 : -1]:
        given = axis[letter]
        carries_work = letters.index(letter) < split
        axes.append(Axis(letter, given.rotary, carries_work, given.direction, given.point, given.range))
    return Machine(topology, topology, tuple(axes), GaugeLine((0.0, 0.0, 1.0), (0.0, 0.0, 80.0)))
