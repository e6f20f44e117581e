"""What data of a design can show at all: sensitivities of the tip, what set-up and base model take away, next of kin.

Independent of the code under test; used to make sure that a hidden effect can be seen, to know its closest relative,
and to judge the gap that is left on held-out poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from .model import Model
from .motion import Array, Mask, inverse, moved, turned
from .physics import Entry, location
from .situation import Situation


def sensitivities(s: Situation) -> Array:
    """d tip / d twist of every frame, workpiece frame (n, 3, n_frames, 6): levers from the reference point to the
    tip.
    """
    machine, carriers = s.machine, s.machine.carriers(s.q)
    tip = moved(carriers["S"][0], np.asarray(machine.tool_point) - np.outer(s.length, machine.tool_direction))
    to_work = np.swapaxes(carriers["W"][0][:, :3, :3], -1, -2)
    result = np.empty((len(s), 3, len(machine.frames), 6))
    for index, frame in enumerate(machine.frames):
        pose, reference = carriers[frame]
        lever = moved(inverse(pose), tip) - reference
        triad = np.asarray(machine.joint(frame).triad) if frame in machine.axes else np.eye(3)
        works = frame == "W" or (frame in machine.axes and not machine.joint(frame).tool_side)
        for part in range(3):
            turn = -to_work @ pose[:, :3, :3] if works else to_work @ pose[:, :3, :3]
            result[:, :, index, part] = turned(turn, np.tile(triad[part], (len(s), 1)))
            result[:, :, index, part + 3] = turned(turn, np.cross(triad[part], lever))
    return result


def first_order(sensitivity: Array, twists: Array) -> Array:
    """Tip displacement (n, 3) of small motions (n, n_frames, 6)."""
    result: Array = np.einsum("nifc,nfc->ni", sensitivity, twists)
    return result


@dataclass(frozen=True, slots=True)
class View:
    """What is free to change without an effect: columns of tip displacement (n, 3, k) of set-up and base constants.

    `seen` (n, 3) is the only direction that a length shows, else None; `given` marks the rows that are handed over.
    """

    setup: Array
    base: Array
    given: Mask
    seen: Array | None = None

    @property
    def columns(self) -> Array:
        """Both together, (n, 3, k)."""
        return np.concatenate([self.setup, self.base], axis=2)

    def observed(self, displacement: Array) -> Array:
        """Displacements (n, 3, ...) as numbers of the given rows: all coordinates, or those along the bar."""
        return self._shown(displacement, self.given)

    def _shown(self, displacement: Array, rows_of: Mask) -> Array:
        rows = displacement[rows_of]
        if self.seen is not None:
            rows = np.einsum("ni,ni...->n...", self.seen[rows_of], rows)[:, None]
        result: Array = rows.reshape(rows.shape[0] * rows.shape[1], *rows.shape[2:])
        return result

    def left(self, values: Array) -> Array:
        """Observed numbers (m, ...) without the part that set-up and base constants can take."""
        basis = _range(self.observed(self.columns))
        result: Array = values - basis @ (basis.T @ values)
        return result

    def gap(self, displacement: Array, refit_base: bool = True) -> float:
        """Rms, mm, of what is left on rows held out, when set-up (and base) are fitted on the given ones.

        Of the length of the vector, or of its part along the bar where the instrument sees no more.
        """
        columns = self.columns if refit_base else self.setup
        rest = displacement - columns @ self._solve(columns, self.observed(displacement))
        return float(np.sqrt(np.sum(self._shown(rest, ~self.given) ** 2) / np.sum(~self.given)))

    def noise_gap(self, sigma: float) -> float:
        """What noise of one coordinate in the fit alone leaves on the rows held out, rms as for `gap`."""
        gain = self._shown(self.columns, ~self.given) @ _pseudo_inverse(self.observed(self.columns))
        return float(sigma * np.sqrt(np.sum(gain**2) / np.sum(~self.given)))

    def _solve(self, columns: Array, values: Array) -> Array:
        result: Array = _pseudo_inverse(self.observed(columns)) @ values
        return result


def _scaled(columns: Array) -> tuple[Array, Array]:
    size = np.linalg.norm(columns, axis=0)
    return columns / np.where(size > 0, size, 1.0), np.where(size > 0, size, 1.0)


def _pseudo_inverse(columns: Array) -> Array:
    scaled, size = _scaled(columns)
    result: Array = np.linalg.pinv(scaled, rcond=1e-8) / size[:, None]
    return result


def _range(columns: Array, tolerance: float = 1e-8) -> Array:
    """Orthonormal basis of the column space."""
    u, d, _ = np.linalg.svd(_scaled(columns)[0], full_matrices=False)
    result: Array = u[:, d > tolerance * d[0]]
    return result


def view(s: Situation, model: Model, given: Mask, kind: str, sensitivity: Array | None = None) -> View:
    """The view of a measurement: set-up unknowns per set, every constant of the model that is handed over."""
    seen = None
    if kind == "length":
        way = s.ball() - s.centre
        seen = way / np.linalg.norm(way, axis=1, keepdims=True)
    slopes = sensitivities(s) if sensitivity is None else sensitivity
    return View(_setup_columns(s, kind), base_columns(s, model, slopes), given, seen)


def _setup_columns(s: Situation, kind: str) -> Array:
    """Of the ball per set (probed: per ball), workpiece frame; of the stylus per tool, tool frame (bars: none)."""
    turn = s.machine.nominal(s.q, s.length)[1]
    places = s.set_id // 2 if kind == "probe" else s.set_id
    tools = s.set_id % 2
    still = [(places == k)[:, None, None] * np.eye(3) for k in np.unique(places)]
    carried = [(tools == k)[:, None, None] * turn for k in np.unique(tools) if kind != "length"]
    return np.concatenate([*still, *carried], axis=2)


def base_columns(s: Situation, model: Model, sensitivity: Array) -> Array:
    """d tip / d coefficient of the model that is handed over, about a perfect machine, (n, 3, k)."""
    columns = []
    for term in model.terms:
        index = s.machine.axes.index(term.axis)
        position = s.q[:, index] / s.machine.units[index]
        for k in range(len(term.coefficients)):
            if term.located:
                columns.append(first_order(sensitivity, location.twists(s, term.axis, term.component)))
            else:
                columns.append(sensitivity[:, :, index, term.component] * term.shape(position, k)[:, None])
    return np.stack(columns, axis=2)


def relatives(
    rng: Generator,
    s: Situation,
    sight: View,
    sensitivity: Array,
    truth: Array,
    rivals: tuple[Entry, ...],
    draws: int = 10,
) -> dict[str, float]:
    """Share of the visible truth that each rival can imitate, by name, the largest first.

    A rival's reach is the span of `draws` specimens of it as seen in the data, directions below 8 % of the strongest
    left out; of several forms of one name the best counts. Who cannot be seen imitates nothing.
    """
    target = sight.left(sight.observed(truth))
    basis = _range(sight.observed(sight.columns))
    shares: dict[str, float] = {}
    for entry in rivals:
        specimens = [first_order(sensitivity, entry.draw(rng)(s)) for _ in range(draws)]
        seen = np.stack([sight.observed(x) / (np.sqrt(np.mean(x**2)) + 1e-30) for x in specimens], axis=1)
        seen -= basis @ (basis.T @ seen)
        u, d, _ = np.linalg.svd(seen, full_matrices=False)
        reach = u[:, d > max(0.08 * d[0], 1e-9)]
        share = float(np.sum((reach.T @ target) ** 2) / np.sum(target**2))
        shares[entry.name] = max(share, shares.get(entry.name, 0.0))
    return dict(sorted(shares.items(), key=lambda item: -item[1]))
