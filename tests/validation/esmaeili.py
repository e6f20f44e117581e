"""S. Esmaeili Marzdashti (PhD thesis, Polytechnique Montreal, 2021): its machines, tables and closed forms.

In her chains every body moves in the positive sense when its axis grows, also on the workpiece side, and location
errors carry what follows. Her frames are shifted and turned against the base; what axes are corrected by is the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ncfix.machine import Axis, Effect, GaugeLine, Machine, State
from ncfix.machine.basis import Polynomial
from ncfix.tables.correction import exact_correction, rotary_correction
from ncfix.tables.scheme import Limits, SchemeTask
from ncfix.tables.scheme_fixed import fixed

Array = np.ndarray
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
HALF = float(np.sqrt(0.5))
GAINS = ("EXX", "EYY", "EZZ")

KOLIBRI_LENGTH = 74.0
KOLIBRI = Machine(
    "Kolibri",
    "w C A Y F X Z t",
    (
        Axis("C", True, True, Z, range=(-np.deg2rad(360), np.deg2rad(360))),
        Axis("A", True, True, X, range=(-np.deg2rad(120), np.deg2rad(120))),
        Axis("Y", False, True, Y, range=(-210.0, 210.0)),
        Axis("X", False, False, X, range=(-130.0, 130.0)),
        Axis("Z", False, False, Z, range=(-40.0, 300.0)),
    ),
)
HURON_LENGTH = 200.0
"""mm: t_y, which the thesis does not print; the levers of Table 7-2 point to about this."""
HURON = Machine(
    "Huron K2X8-Five",
    "w C A Y F X Z t",
    (
        Axis("C", True, True, Z, range=(-np.pi, np.pi)),
        Axis(
            "A", True, True, (HALF, 0.0, HALF), range=(-np.pi / 2, np.pi / 2),
            error_axes=((HALF, 0.0, HALF), Y, (-HALF, 0.0, HALF)),
        ),
        Axis("Y", False, True, Y, range=(-350.0, 350.0)),
        Axis("X", False, False, X, range=(-325.0, 325.0)),
        Axis("Z", False, False, Z, range=(-50.0, 400.0)),
    ),
    GaugeLine(Z),
)  # fmt: skip
"""A lies at 45 degrees between X and Z. Her tool frame has y along -z of the base and z along y."""

HU40 = Machine(
    "HU40",
    "w C B X F Z Y t",
    (
        Axis("C", True, True, Z, range=(-2 * np.pi, 2 * np.pi)),
        Axis("B", True, True, Y, range=(-np.pi / 2, np.pi / 2)),
        Axis("X", False, True, X, range=(-305.0, 305.0)),
        Axis("Z", False, False, Z, range=(-280.0, 280.0)),
        Axis("Y", False, False, Y, range=(-280.0, 280.0)),
    ),
)

# mrad -> rad, um -> mm, um/mm. The gains are relative to X.
TEN = ("EB0A", "EC0A", "EY0C", "EA0C", "EB0C", "EC0X", "EA0Z", "EB0Z", "EYY", "EZZ")
TABLE_6_4 = dict(
    zip(TEN, np.array([1.09, -0.86, 42.1, 0.07, 0.03, 0.14, -0.44, 0.11, -0.61, -0.22]) * 1e-3, strict=True)
)
TABLE_6_5 = dict(
    zip(TEN, np.array([1.29, -0.98, 41.4, 0.07, 0.03, 0.15, -0.48, 0.15, -0.64, -0.25]) * 1e-3, strict=True)
)
# value and U, urad, um, um/m; her EZ0S is along the base's y
TABLE_7_2 = {
    "EY0S": (55.6e-3, 6.8e-3), "EA0Z": (106e-6, 14.5e-6), "EZZ": (30e-6, 13.8e-6), "EB0A": (39.1e-6, 10.6e-6),
    "EA0C": (33.8e-6, 8.3e-6), "EC0X": (-32e-6, 10.8e-6), "EB0Z": (22e-6, 8e-6), "EB0C": (-14.6e-6, 3.3e-6),
    "EXX": (25.9e-6, 8.1e-6), "EX0S": (-2.1e-3, 4.9e-3), "EYY": (-14.3e-6, 12.8e-6), "EC0A": (5.5e-6, 13.7e-6),
    "EY0C": (1e-3, 1.4e-3),
}  # fmt: skip
# Table 4-3, BC machine: rad, mm
TABLE_4_3 = {
    "EA0B": -4e-5, "EC0B": -1e-6, "EX0C": -0.0956, "EA0C": -1.2e-5, "EB0C": 1.1e-5, "EB0Z": -1e-5, "EA0Y": -3.8e-5,
    "EC0Y": 1.5e-5, "EY0S": 0.0293, "EX0S": -0.1, "EXX": -1.7e-5, "EYY": -2.3e-5, "EZZ": -3.2e-5,
}  # fmt: skip
# Table 5-4 with the entry (-50, -300) of Table 6-3: A and C of the validation S
VALIDATION = """
8,55 16,120 40,180 38,240 55,300 50,330 45,270 36,210 23,150 12,90 4,30 -5,-30 -12,-90 -28,-150 -31,-210 -48,-270
-52,-330 -50,-300 -43,-240 -34,-180 -23,-120 -11,-55 8,140 18,190 12,250 30,290 22,310 47,10 24,50 38,100 41,160 53,200
-34,-45 -43,-140 -50,-170 -20,-220 -15,-280 -10,-310 -5,-70 -16,135 -50,280 -36,94 -10,20 -26,200 28,-40 50,-300 20,-280
37,-100 10,-280 0,0 0,90 0,240 0,300 0,180 0,45 0,-45 0,-180 0,-300 0,-240 0,-90
"""


def effects(values: Mapping[str, float]) -> tuple[Effect, ...]:
    """The errors of a table: gains as lines through zero, the rest locations that carry what follows."""
    line = Polynomial(degree=(1,))
    return tuple(
        Effect(name, (float(value),), line) if name in GAINS else Effect(name, (float(value),), carried=name[-1] != "S")
        for name, value in values.items()
    )


def kolibri(values: Mapping[str, float]) -> Machine:
    """The machine of chapters 5 and 6 with these errors."""
    return KOLIBRI.replace(effects=effects(values))


def huron(values: Mapping[str, float]) -> Machine:
    """The machine of chapter 7 with these errors."""
    return HURON.replace(effects=effects(values))


def at_balls(known: Machine, length: float, turns: Array, balls: Array) -> Array:
    """Positions with the tip of a perfect machine at each ball, for each pair of A and C (rad): (pairs x balls, 5)."""
    names = list(known.axis_names)
    linear = [names.index(axis) for axis in "XYZ"]
    q = np.zeros((len(turns) * len(balls), len(names)))
    q[:, [names.index("A"), names.index("C")]] = np.repeat(turns, len(balls), axis=0)
    place = np.tile(balls, (len(turns), 1))
    by_axes = np.linalg.inv(known.axis_jacobian(q, length)[:, :3, linear])
    q[:, linear] -= np.einsum("nij,nj->ni", by_axes, known.tip(q, length) - place)
    return q


def validation() -> Array:
    """The probings of run S: one ball, 90 mm from C (the lever of EC0A in Table 5-5), 37.5 mm above A."""
    turns = np.deg2rad([[float(value) for value in pair.split(",")] for pair in VALIDATION.split()])
    return at_balls(KOLIBRI, KOLIBRI_LENGTH, turns, np.array([[90.0, 0.0, 37.5]]))


def huron_probings() -> Array:
    """Probings over the travels; those of the thesis are not printed."""
    random = np.random.default_rng(1)
    turns = random.uniform([-np.pi / 2, -np.pi], [np.pi / 2, np.pi], (60, 2))
    balls = np.array([[120.0, 0.0, 60.0], [-60.0, 100.0, 120.0], [-60.0, -100.0, 180.0]])
    return at_balls(HURON, HURON_LENGTH, turns, balls)


def sizes_um(known: Machine, q: Array, correction: Array, length: float) -> Array:
    """The tip error at commands that are corrected, as a length, um."""
    gap = known.actual_tip(q + correction, State(length)) - known.tip(q, length)
    return 1e3 * np.linalg.norm(gap, axis=-1)


def by_kinematics(known: Machine, q: Array, length: float) -> Array:
    """Her kinematics-based correction: rotary axes from the three angles, the linear ones for what is left."""
    turned = np.zeros_like(q)
    turned[:, known.rotary] = rotary_correction(known, q, State(length))
    return exact_correction(known, q, State(length), turned)


def by_tables(known: Machine, q: Array, length: float, name: str, room: Sequence[tuple[float, float]]) -> Array:
    """The correction of one of her schemes, its tables fitted over this room (mm, rad)."""
    job = SchemeTask(known, np.array(room), length, 1e-4, Limits(100, 100_000))
    return fixed(job, name).tables.at(known.axis_names, q, np.zeros_like(q))


def room_of(q: Array) -> list[tuple[float, float]]:
    """The ranges of some positions."""
    return [(float(low), float(high)) for low, high in zip(q.min(axis=0), q.max(axis=0), strict=True)]


# -- Eq. 42 and 43 ----------------------------------------------------------------------------------------------------


def inverse_43(q: Mapping[str, float], as_printed: bool = False) -> Array:
    """Eq. 43, the pseudo-inverse of the Kolibri's Jacobian: X Y Z A C by X Y Z A B C of her tool frame.

    Two of the printed entries are corrected.
    """
    x, y, z = q["X"], q["Y"], q["Z"]
    s, k = np.sin(q["A"]), np.cos(q["A"])
    lever = k * y - s * z
    return np.array(
        [
            [1, 0, 0, 0, s * lever, -k * lever],
            [0, -1, 0, -z, s * lever if as_printed else -s * k * x, k * k * x],
            [0, 0, 1, y, s * s * x, -s * k * x],
            [0, 0, 0, -1, 0, 0],
            [0, 0, 0, 0, s, k if as_printed else -k],
        ]
    )


# -- Eq. 59 -----------------------------------------------------------------------------------------------------------


def closed_59(q: Mapping[str, float], length: float) -> dict[str, Array]:
    """Eq. 59 with its ten slips corrected: what to take off X Y Z A C per unit of each error; A at 45 degrees."""
    x, y, a = q["X"], q["Y"], q["A"]
    z = q["Z"] - length
    s, c, s2, c2, r = np.sin(a), np.cos(a), np.sin(2 * a), np.cos(2 * a), np.sqrt(2)
    return {
        "EC0X": np.array([(-y * (c2 + 3) + r * s2 * z) / 4, -s * s * (x + z) / 2, (y * (1 - c2) - r * x * s2) / 4,
                          r / 2 * (c - 1), -c]),
        "EA0Z": np.array([(y * (c2 - 1) - r * s2 * z) / 4, s * s * (x + z) / 2, (y * (3 + c2) + r * x * s2) / 4,
                          -r / 2 * (c + 1), c]),
        "EB0Z": np.array([c * (2 * c * z + r * y * s) / 2, -r * s2 * (x + z) / 4, s * (2 * x * s + r * y * c) / 2,
                          -s, r * s]),
        "EB0A": np.array([c * (-2 * c * z - r * y * s) / 2, r * s2 * (x + z) / 4, c * (2 * x * c - r * y * s) / 2,
                          s, -r * s]),
        "EC0A": np.array([(r * y * (c2 - 1) - 2 * s2 * z) / 4, r * s * s * (x + z) / 2,
                          (r * y * (c2 - 1) + 2 * x * s2) / 4, -c, r * c]),
        "EY0C": np.array([r / 2 * s, c, -r / 2 * s, 0, 0]),
        "EA0C": np.array([0, 0, 0, r, -1]),
        "EB0C": np.array([-c * z - r / 2 * y * s, r / 2 * s * (x + z), x * c - r / 2 * y * s, 0, 0]),
        "EX0S": np.array([1.0, 0, 0, 0, 0]),
        "EY0S": np.array([0, -1.0, 0, 0, 0]),
        "EXX": np.array([x, 0, 0, 0, 0]),
        "EYY": np.array([0, y, 0, 0, 0]),
        "EZZ": np.array([0, 0, q["Z"], 0, 0]),
    }  # fmt: skip


def printed_59(q: Mapping[str, float], length: float) -> dict[str, Array]:
    """Eq. 59 as it is printed: ten of its 65 entries differ."""
    x, y, a = q["X"], q["Y"], q["A"]
    z = q["Z"] - length
    s, c, s2, c2, r = np.sin(a), np.cos(a), np.sin(2 * a), np.cos(2 * a), np.sqrt(2)
    slips = {
        "EC0X": {0: (y * (c2 - 3) + r * s2 * z) / 4, 1: (c * c - 1) * -(x + z) / 2},
        "EB0Z": {0: (2 * c * z - r * y * s) / 4, 1: -s2 * (x + z) / 2, 2: r * s * (y * c + r * x * s2) / 2},
        "EB0A": {0: c * (-c * z - r * y * s) / 2},
        "EC0A": {0: (-r * y * (c2 - 1) - 2 * s2 * z) / 4, 1: -r * s * s * (x + z) / 2, 2: (r * y * c * c + x * s2) / 2},
        "EB0C": {2: x * c},
    }
    found = closed_59(q, length)
    for name, entries in slips.items():
        for row, value in entries.items():
            found[name][row] = value
    return found


def by_closed_form(values: Mapping[str, float], q: Array, length: float, form=closed_59) -> Array:
    """What the closed forms add to the commands (n, 5) in the machine's order C A Y X Z: their sum, taken off."""
    found = np.zeros_like(q)
    for row, place in enumerate(q):
        columns = form(dict(zip(HURON.axis_names, place, strict=True)), length)
        total = sum(value * columns[name] for name, value in values.items())
        found[row] = -np.array([total[4], total[3], total[1], total[0], total[2]])
    return found
