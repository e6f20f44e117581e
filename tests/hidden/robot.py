"""A six-axis robot before a laser tracker: machine file and measurements of kind `points`, made without ncfix.

`python -m tests.hidden.robot FOLDER --seed 3` writes `robot.toml` (the nominal arm), `calibration.csv` and
`check.csv`. The arm is a chain of turns about lines (Rodrigues), its links have masses, and the gears of the joints
yield in proportion to the moment of gravity about their lines, worked out at the pose that the arm really has. Besides
that: zeros of joints that are off, links of other lengths, run-out of a gear's output. Nothing here imports ncfix.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]
JOINTS = "JKLMNO"
ABOUT = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=np.float64)
POINTS = np.array([[0, 0, 0], [300, 0, 600], [300, 0, 1700], [400, 0, 1900], [1700, 0, 1900], [1900, 0, 1900]], float)
FLANGE = np.array([2000.0, 0.0, 1900.0])
RANGES = ((-120, 120), (-70, 60), (-100, 60), (-160, 160), (-100, 100), (-170, 170))
MASSES = ((1, 180.0, (300.0, 60.0, 1150.0)), (2, 140.0, (650.0, 0.0, 1880.0)), (4, 35.0, (1705.0, 0.0, 1900.0)))
"""Of the arm: the number of the joint that carries it, kg, and where it is with all joints at zero, mm."""
GRAVITY = 9.81


@dataclass(frozen=True)
class Robot:
    """What is wrong with it.

    zeros    joint -> degrees that its zero is off
    shifts   joint -> mm (3,) that its line is off, with all joints at zero
    yields   joint -> rad per Nm of its gear
    waves    joint -> (orders a turn, rad, phase) of its gear
    play     joint -> rad of lost motion
    """

    zeros: Mapping[str, float] = field(default_factory=dict)
    shifts: Mapping[str, Sequence[float]] = field(default_factory=dict)
    yields: Mapping[str, float] = field(default_factory=dict)
    waves: Mapping[str, tuple[int, float, float]] = field(default_factory=dict)
    play: Mapping[str, float] = field(default_factory=dict)

    def flange(self, q: Array, ways: Array, load_kg: float = 1.5) -> tuple[Array, Array]:
        """Where the flange is and how it is turned, (n, 3) mm and (n, 3, 3), for angles (n, 6) in degrees."""
        angles = np.radians(q)
        for k, joint in enumerate(JOINTS):
            angles[:, k] += np.radians(self.zeros.get(joint, 0.0))
            if joint in self.waves:
                order, size, phase = self.waves[joint]
                angles[:, k] += size * np.sin(order * np.radians(q[:, k]) + phase)
            angles[:, k] += 0.5 * self.play.get(joint, 0.0) * ways[:, k]
        hanging = angles
        for _ in range(3 if self.yields else 0):  # the moment is that of the arm as it hangs
            moments = self._moments(hanging, load_kg)
            hanging = angles + moments * np.array([self.yields.get(joint, 0.0) for joint in JOINTS])
        angles = hanging
        places, turns = self._bodies(angles)
        return _carried(places[-1], turns[-1], FLANGE), turns[-1]

    def _bodies(self, angles: Array) -> tuple[list[Array], list[Array]]:
        """For each joint's body: shift (n, 3) and turn (n, 3, 3) from where it is with all joints at zero."""
        shift, turn = np.zeros((len(angles), 3)), np.tile(np.eye(3), (len(angles), 1, 1))
        shifts, turns = [], []
        for k, joint in enumerate(JOINTS):
            line = POINTS[k] + np.asarray(self.shifts.get(joint, (0.0, 0.0, 0.0)))
            own = _about(ABOUT[k], angles[:, k])
            shift = shift + np.einsum("nij,nj->ni", turn, line - np.einsum("nij,j->ni", own, line))
            turn = turn @ own
            shifts.append(shift)
            turns.append(turn)
        return shifts, turns

    def _moments(self, angles: Array, load_kg: float) -> Array:
        """Moments of gravity about the joints, (n, 6) Nm."""
        shifts, turns = self._bodies(angles)
        masses = [*MASSES, (5, load_kg, (2060.0, 0.0, 1900.0))]
        found = np.zeros((len(angles), 6))
        for k in range(6):
            before = (shifts[k - 1], turns[k - 1]) if k else (np.zeros((len(angles), 3)), np.eye(3)[None])
            line, about = _carried(*before, POINTS[k]), np.broadcast_to(before[1] @ ABOUT[k], (len(angles), 3))
            for carrier, kg, place in masses:
                if carrier >= k:
                    arm = (_carried(shifts[carrier], turns[carrier], np.array(place)) - line) / 1e3
                    force = np.array([0.0, 0.0, -GRAVITY * kg])
                    found[:, k] += (np.cross(arm, force) * about).sum(axis=1)
        return found


def _about(axis: Array, angle: Array) -> Array:
    """Turns (n, 3, 3) by Rodrigues' formula."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    sine, rest = np.sin(angle)[:, None, None], (1 - np.cos(angle))[:, None, None]
    found: Array = np.eye(3) + sine * cross + rest * (cross @ cross)
    return found


def _carried(shift: Array, turn: Array, place: Array) -> Array:
    found: Array = shift + np.einsum("nij,j->ni", np.broadcast_to(turn, (len(shift), 3, 3)), place)
    return found


def toml() -> str:
    """The nominal arm as a machine file."""
    text = f'topology = "w F {" ".join(JOINTS)} t"\nmax_correction = {{ linear = 10.0, rotary = 1.0 }}\n\n'
    text += f"[tool]\ndirection = [-1, 0, 0]\npoint = {FLANGE.tolist()}\n"
    for name, about, place, limits in zip(JOINTS, ABOUT.astype(int).tolist(), POINTS.tolist(), RANGES, strict=True):
        text += f'\n[axis.{name}]\ntype = "rotary"\ndirection = {about}\npoint = {place}\nrange = {list(limits)}\n'
    return text


def measured(robot: Robot, rng: Generator, count: int, noise_um: float = 20.0) -> str:
    """Readings of a tracker on three targets of the end effector, in poses drawn over the working range."""
    low, high = np.array(RANGES).T
    targets = np.array([[2090.0, 45.0, 1870.0], [2060.0, -70.0, 1960.0], [2140.0, 20.0, 1985.0]])
    stand, turned = np.array([-2600.0, 900.0, 1150.0]), _about(np.array([0.0, 0.0, 1.0]), np.array([0.3]))[0]
    rows, last = [], np.zeros(6)
    for number in range(count):
        while True:
            q = np.round(rng.uniform(0.9 * low, 0.9 * high), 2)
            places, turns = Robot().flange(q[None], np.zeros((1, 6)))
            if places[0, 2] > 250.0 and np.hypot(*places[0, :2]) > 500.0:
                break
        ways = np.where(q > last, 1, -1)
        last = q
        places, turns = robot.flange(q[None], ways[None].astype(float))
        for name, target in zip("abc", targets, strict=True):
            seen = turned @ (places[0] + turns[0] @ (target - FLANGE) - stand)
            seen = seen + rng.normal(scale=1e-3 * noise_um, size=3)
            row = [name, *(f"{x:g}" for x in q), *(f"{x:.4f}" for x in seen), f"{60 * number}", *(str(w) for w in ways)]
            rows.append(",".join(row))
    head = "# ncfix-measurement: 1\n# kind: points\n# carried_by: tool\n# frame: instrument\n"
    head += f"# instrument: laser tracker\n# noise_um: {noise_um:g}\n# target: a 2090 45 1870\n"
    names = ["target", *JOINTS, "x", "y", "z", "time_s", *(f"dir_{joint}" for joint in JOINTS)]
    return head + ",".join(names) + "\n" + "\n".join(rows) + "\n"


def drawn(rng: Generator) -> Robot:
    """A robot as before a calibration, with two soft joints and a gear that runs out."""
    zeros = {joint: round(float(rng.normal(scale=0.08)), 4) for joint in "KLN"}
    shifts = {"L": (float(rng.normal(scale=0.3)), 0.0, float(rng.normal(scale=0.4)))}
    soft = {"K": float(rng.uniform(3e-7, 5e-7)), "L": float(rng.uniform(4e-7, 7e-7))}
    return Robot(zeros, shifts, soft, {"J": (1, 1.2e-4, float(rng.uniform(0, 6)))}, {})


def main() -> None:
    """Write a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--count", type=int, default=80)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    robot = drawn(rng)
    given.folder.mkdir(parents=True, exist_ok=True)
    (given.folder / "robot.toml").write_text(toml())
    (given.folder / "calibration.csv").write_text(measured(robot, rng, given.count))
    (given.folder / "check.csv").write_text(measured(robot, rng, given.count))


if __name__ == "__main__":
    main()
