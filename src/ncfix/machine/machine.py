"""The machine: its axes, its errors, and what both do with axis positions."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ncfix.arrays import Array, Mask
from ncfix.machine import error_model, linear, se3
from ncfix.machine.aim import Aim, aimed, aimed_ahead, gaps
from ncfix.machine.axes import ORIGIN, Axis, Effect, GaugeLine, Vector, degrees
from ncfix.machine.chain import JointChain, build_chain, carried_frames, carried_tips
from ncfix.machine.error_model import DeviationBounds, ErrorModel, bow_of, compile_effects, direction_axis
from ncfix.machine.linear import Jacobians
from ncfix.machine.route import Route, SplitRoute, Turns, route_of, split_route_of
from ncfix.machine.state import Poses, Signal, State, flatten, inputs_of, poses_first, with_lags
from ncfix.machine.steps import SMALL
from ncfix.toml_text import written
from ncfix.values import frozen

DEFAULT_INCREMENT = (0.001, 0.001 * np.pi / 180)
"""What controls resolve, linear and rotary axes: 1 um, in mm, and 0.001 degree, in rad."""
DEFAULT_CORRECTION = (0.5, 0.05 * np.pi / 180)
"""Corrections that are refused are larger: 0.5 mm, and 0.05 degree, in rad."""


@frozen(slots=False)
class Machine:
    """A serial machine tool with its errors. Immutable; `replace` makes another.

    name              for people
    topology          as in the machine file, e.g. "w C B F X Y Z t"
    axes              from the workpiece to the foundation, then from the foundation to the tool
    tool              the end of the tool branch
    effects           the errors
    control           default control of the machine
    least_increment   (mm, rad) what the control can resolve
    max_correction    (mm, rad) corrections above it are refused
    workpiece_offset  origin of the workpiece frame in the base frame with all axes at zero, mm
    provenance        where the errors come from; free keys
    conditions        inputs of the error model that a `State` need not give, by name

    Positions `q` have shape (..., n_axes) in mm and rad; states and positions broadcast. The workpiece frame rides on
    the last body of the workpiece branch; the tool frame has its origin at the tip and is parallel to the base axes
    when all axes are at zero.
    """

    name: str
    topology: str
    axes: tuple[Axis, ...]
    tool: GaugeLine = GaugeLine()
    effects: tuple[Effect, ...] = ()
    control: str | None = None
    least_increment: tuple[float, float] = DEFAULT_INCREMENT
    max_correction: tuple[float, float] = DEFAULT_CORRECTION
    workpiece_offset: Vector = ORIGIN
    provenance: Mapping[str, Any] = field(default_factory=dict)
    conditions: Mapping[str, float] = field(default_factory=dict)

    # -- what it is ---------------------------------------------------------------------------------------------------

    @property
    def axis_names(self) -> tuple[str, ...]:
        """The letters of the axes, in the order of the columns of q."""
        return tuple(axis.name for axis in self.axes)

    def axis(self, name: str) -> Axis | None:
        """The axis with this letter; None for a name that is none."""
        return next((axis for axis in self.axes if axis.name == name), None)

    def is_positioning(self, name: str) -> bool:
        """Whether an ISO 230-1 error motion is the positioning of its axis: EXX of X, EZW of a W along Z."""
        axis = self.axis(name[-1])
        return axis is not None and len(name) == 3 and axis.owns(name[1])

    @cached_property
    def rotary(self) -> Mask:
        """Which axes are rotary, shape (n_axes,)."""
        return np.array([axis.rotary for axis in self.axes], dtype=np.bool_)

    @cached_property
    def ranges(self) -> Array:
        """Lowest and highest position of each axis, shape (n_axes, 2), mm and rad; infinite where endless."""
        return np.array([axis.range for axis in self.axes], dtype=np.float64).reshape(-1, 2)

    @cached_property
    def is_perfect(self) -> bool:
        """Whether no effect has a coefficient that is not zero."""
        return not any(effect.active for effect in self.effects)

    @property
    def inputs(self) -> frozenset[str]:
        """The names that `State.inputs` must have."""
        return self._model.inputs - {"tool_length"}

    def replace(self, **changes: Any) -> Machine:
        """This machine with some fields changed."""
        return dataclasses.replace(self, **changes)

    @cached_property
    def _model(self) -> ErrorModel:
        return compile_effects(self.axes, self.tool, self.effects)

    @cached_property
    def _chain(self) -> JointChain:
        return build_chain(self.axes, self._model)

    @cached_property
    def _route(self) -> Route | None:
        return route_of(self.axes, self.tool, self._chain.joints, self._model, self.workpiece_offset)

    @cached_property
    def _perfect_route(self) -> Route:
        route = route_of(self.axes, self.tool, self._chain.joints, None, self.workpiece_offset)
        assert route is not None, "only errors keep a chain from being written as steps"
        return route

    @cached_property
    def _split_route(self) -> SplitRoute | None:
        return split_route_of(self.axes, self.tool, self._chain.joints, self._model, self.workpiece_offset)

    @cached_property
    def hash(self) -> str:
        """12 hexadecimal digits of what matters to a correction: not of names, uncertainties, provenance or zeros."""
        effects = tuple(dataclasses.replace(effect, covariance=None) for effect in self.effects if effect.active)
        axes = tuple(dataclasses.replace(axis, pitch=None) for axis in self.axes)
        bare = self.replace(name="", control=None, provenance={}, effects=effects, axes=axes)
        return hashlib.sha256(dumps(bare).encode()).hexdigest()[:12]

    def known_from(self, notes: Mapping[str, Any]) -> Machine:
        """With further provenance. Where its errors came from before stays under `earlier`, the newest last."""
        before = dict(self.provenance)
        earlier = before.pop("earlier", [])
        earlier = list(earlier) if isinstance(earlier, (list, tuple)) else [earlier]
        if "source" in before and before["source"] != notes.get("source"):
            earlier.append(" ".join(str(before[key]) for key in ("date", "source") if key in before))
        history = {"earlier": earlier} if earlier else {}
        return self.replace(provenance={**before, **notes, **history})

    @cached_property
    def depends_on_tool_length(self) -> bool:
        """Whether the error of the tip depends on the length of the tool."""
        return any(error_model.needs_tool_length(self.axes, effect) for effect in self.effects if effect.active)

    @cached_property
    def feature_lengths(self) -> Array:
        """The smallest distance over which the errors may bend as each axis moves, shape (n_axes,), mm or rad.

        Spacing of knots or table entries, an eighth of a period, range / (4 degree) of a polynomial; inf for an axis
        on which nothing depends.
        """
        lengths = error_model.feature_lengths(self.axes, self.effects)
        lengths.flags.writeable = False
        return lengths

    def breakpoints(self, axis: str) -> Array:
        """Positions of an axis at which an error has a kink or a jump, ascending, shape (k,), mm or rad.

        Those of an endless axis come again with every turn.
        """
        return self._breakpoints[self.axis_names.index(axis)].copy()

    @cached_property
    def _breakpoints(self) -> tuple[Array, ...]:
        return error_model.breakpoints(self.axes, self.effects)

    @cached_property
    def kinks(self) -> tuple[tuple[int, Array], ...]:
        """The axes (columns) with kinks or jumps of their errors, and where these are, see `error_model.kinks`."""
        return error_model.kinks(self.axes, self.effects, self._breakpoints)

    @cached_property
    def directed(self) -> tuple[int, ...]:
        """The axes (columns) of which it matters to some error in which way they came to their position."""
        found = {direction_axis(self.axes, effect) for effect in self.effects if effect.active}
        return tuple(sorted(found - {-1}))

    @property
    def depends_on_direction(self) -> bool:
        """Whether any error depends on the way in which an axis came to its position."""
        return bool(self.directed)

    @cached_property
    def bow(self) -> DeviationBounds | None:
        """How far the error of the tip may bow on straight motions; None if not known."""
        return bow_of(self.axes, self.tool, self.effects)

    @cached_property
    def linear_ways(self) -> Array | None:
        """The ways of X, Y and Z as columns, (3, 3): motions of them take the tip so far, to wherever they point.

        None without these axes, or if a rotary axis between them turns some of them only.
        """
        names = [self.axis_names.index(name) for name in "XYZ" if name in self.axis_names]
        return self._perfect_route.ways_together(names) if len(names) == 3 else None

    @cached_property
    def at_zero(self) -> tuple[Array, Array]:
        """Where a perfect machine with all axes at zero and no tool has its tip, (3,) mm.

        And how the tip follows each linear axis there, (n_axes, 3) mm per mm; zeros for rotary ones.
        """
        nowhere, ways = np.zeros(len(self.axes)), np.zeros((len(self.axes), 3))
        ways[~self.rotary] = self.follows(nowhere, tuple(np.flatnonzero(~self.rotary).tolist())).T
        return self.tip(nowhere), ways

    # -- what it does -------------------------------------------------------------------------------------------------

    def tip(self, q: ArrayLike, tool_length: ArrayLike = 0.0) -> Array:
        """Where the tip of a perfect machine is in the workpiece frame, shape (..., 3) [mm]."""
        return self._tip(q, State(tool_length), None)

    def actual_tip(self, q: ArrayLike, state: State = State()) -> Array:  # noqa: B008
        """Where the tip really is in the workpiece frame, shape (..., 3) [mm]."""
        return self._tip(q, state, None if self.is_perfect else self._model)

    def gaps(self, meant: Array, done: Sequence[Array], state: State, tip: Array | None = None) -> list[Array]:
        """Where the tip really is with the axes at each of `done`, minus where a perfect machine has it at `meant`.

        All (n, n_axes); (n, 3) mm each, and `tip`: where that is, if known. Sines are worked out once if they can be.
        """
        model, perfect = None if self.is_perfect else self._model, self._perfect_route
        route = perfect if model is None else self._route
        goals = self._poses(meant, state, model)[1]
        others = [goals if q is meant else self._poses(q, state, model)[1] for q in done]

        def tips(by: Route | None, poses: Poses, turns: Turns | None) -> Array:
            return self._tips_along(by, poses, None if by is perfect else model, turns)

        return gaps(perfect, route, tips, goals, others, tip)

    def aim(
        self,
        q: ArrayLike,
        axes: tuple[int, int, int],
        state: State = State(),  # noqa: B008
        target: ArrayLike | None = None,
    ) -> Aim:
        """Where linear axes (columns `axes`: X, Y, Z) must stand so that the real tip is at `target`.

        q       (n, n_axes) where to begin, and where all other axes are
        target  (n, 3) mm; where a perfect machine has the tip at q if not given

        Rows are poses in what is returned. An axis that cannot bring the tip there is left where that shows.
        """
        _, poses = self._poses(q, state, self._model)
        goal = None if target is None else np.ascontiguousarray(np.asarray(target, dtype=np.float64).T)
        found = Aim.of(poses.positions.shape[1])
        for part, chunk in poses.chunks():
            found.put(part, self._aim(chunk, axes, None if goal is None else goal[:, part]))
        return Aim(found.place.T, found.arrived, found.off)

    def _aim(self, poses: Poses, axes: tuple[int, int, int], target: Array | None) -> Aim:
        split = self._split_route
        if split is None or split.axes != axes:
            return self._aim_at_length(poses, axes, target)
        found, rows = aimed_ahead(poses, self._perfect_route, split, target)
        if rows.size:
            goal = None if target is None else target[:, rows]
            found.put(rows, self._aim_at_length(poses.part(rows), axes, goal))
        return found

    def _aim_at_length(self, poses: Poses, axes: tuple[int, int, int], target: Array | None) -> Aim:
        perfect, route = self._perfect_route, self._route

        def tips(here: Poses, turns: Turns) -> tuple[Array, Array]:
            return self._tips_along(route, here, self._model, turns), np.zeros(1)

        turns = (route or perfect).turns(poses)
        goal = perfect.tips(poses, turns)[0] if target is None else target
        return aimed(poses, axes, turns, tips, perfect.ways(axes, turns), goal)[0]

    def nominal(self, q: ArrayLike, tool_length: ArrayLike = 0.0) -> Array:
        """`workpiece_from_tool` of a perfect machine, shape (..., 4, 4)."""
        return self._pose(q, State(tool_length), None)

    def actual(self, q: ArrayLike, state: State = State()) -> Array:  # noqa: B008
        """`workpiece_from_tool` as it really is: the exact composition of all finite motions, shape (..., 4, 4)."""
        return self._pose(q, state, None if self.is_perfect else self._model)

    def error(self, q: ArrayLike, state: State = State()) -> Array:  # noqa: B008
        """Actual minus nominal in the workpiece frame, shape (..., 6): [dx dy dz rx ry rz], mm and rad.

        [rx ry rz] is the rotation vector of R_actual R_nominal^T.
        """
        actual, nominal = self.actual(q, state), self.nominal(q, state.tool_length)
        shift = actual[..., :3, 3] - nominal[..., :3, 3]
        turn = se3.rotation_vector(actual[..., :3, :3] @ np.swapaxes(nominal[..., :3, :3], -1, -2))
        return np.concatenate([shift, turn], axis=-1)

    def follows(self, q: ArrayLike, axes: tuple[int, ...]) -> Array:
        """How the tip of a perfect machine follows linear axes, shape (..., 3, axes) mm per mm, workpiece frame."""
        route = self._perfect_route

        def ways(chunk: Poses, _: slice) -> Array:
            n = chunk.positions.shape[1]
            found = [[np.broadcast_to(along, n) for along in way] for way in route.ways(axes, route.turns(chunk))]
            return np.array(found).reshape(len(axes), 3, n).swapaxes(0, 1)

        return self._evaluated(q, State(), None, ways, 3, len(axes))

    def xyz_for_tip(
        self, q: ArrayLike, axes: tuple[int, ...], target: ArrayLike, tool_length: ArrayLike = 0.0
    ) -> Array:
        """Where X, Y and Z (columns `axes`) of a perfect machine have to be for the tip to be at `target` (n, 3) mm.

        q  (n, n_axes) where all other axes are

        Shape (n, 3). Only with `linear_ways` that span space.
        """
        assert self.linear_ways is not None
        goal = np.ascontiguousarray(np.asarray(target, dtype=np.float64).T)
        back: Array = np.linalg.inv(self.linear_ways).astype(np.float64)

        def places(chunk: Poses, part: slice) -> Array:
            return self._perfect_route.xyz_for_tip(chunk, axes, back, goal[:, part])

        return self._evaluated(q, State(tool_length), None, places, 3)

    def axis_jacobian(self, q: ArrayLike, tool_length: ArrayLike = 0.0) -> Array:
        """The derivative of the nominal tip pose by the axis positions, shape (..., 6, n_axes); see `Jacobians`."""

        def by_axes(chunk: Poses, _: slice) -> Array:
            return linear.axis_jacobian(self.axes, self.tool, chunk)

        return self._evaluated(q, State(tool_length), None, by_axes, 6, len(self.axes))

    def jacobians(self, q: ArrayLike, tool_length: ArrayLike = 0.0) -> Jacobians:
        """Derivatives of the nominal tip pose by axis positions and by joint errors; see `Jacobians`."""

        def by_joints(chunk: Poses, _: slice) -> Array:
            return linear.joint_jacobian(self.axes, self.tool, chunk, range(len(self.axes) + 1))

        joints = self._evaluated(q, State(tool_length), None, by_joints, 6, len(self.axes) + 1, 6)
        return Jacobians(self.axis_jacobian(q, tool_length), joints)

    def joint_errors(self, q: ArrayLike, state: State = State()) -> Array:  # noqa: B008
        """The error twist of each joint to first order, shape (..., n_joints, 6): [ex ey ez ea eb ec], mm and rad.

        In its error axes, at its reference point, location errors included; the last joint is the spindle. Times
        `jacobians(q).joints` it is `error(q)` up to terms of second order.
        """
        shape, poses = self._poses(q, state, self._model)
        active = [effect for effect in self.effects if effect.active]
        return poses_first(linear.joint_errors(self.axes, self.tool, active, poses), shape)

    def design(
        self,
        q: ArrayLike,
        state: State = State(),  # noqa: B008
        effects: Sequence[Effect] | None = None,
    ) -> Array:
        """The derivative of `error` by the coefficients at zero error, shape (..., 6, k).

        The columns are those of the effects in turn, whatever their present coefficients; `effects` are those of the
        machine if not given, and may be any others of its joints.
        """
        shape, found = self._design(q, state, self.effects if effects is None else tuple(effects))
        return poses_first(found, shape)

    def design_columns(self, q: Array, state: State, effects: Sequence[Effect]) -> Array:
        """As `design`, column by column, (6, k, n) for q (n, n_axes): quicker where there are many effects."""
        return self._design(q, state, tuple(effects))[1]

    def _design(self, q: ArrayLike, state: State, effects: tuple[Effect, ...]) -> tuple[tuple[int, ...], Array]:
        """The common leading shape, and the design with poses last, (6, k, n)."""
        shared = linear.Dependences.of(self.axes, effects)
        shape, poses = self._with_signals(q, state, shared.signals)
        return shape, linear.design(self.axes, self.tool, effects, shared, poses)

    def _poses(self, q: ArrayLike, state: State, model: ErrorModel | None) -> tuple[tuple[int, ...], Poses]:
        """The common leading shape, and the poses with all the signals that the model needs."""
        return self._with_signals(q, state, model.signals if model is not None else frozenset())

    def _with_signals(self, q: ArrayLike, state: State, signals: frozenset[Signal]) -> tuple[tuple[int, ...], Poses]:
        """The common leading shape, and the poses with these signals."""
        if self.conditions and signals:
            state = dataclasses.replace(state, inputs={**self.conditions, **state.inputs})
        shape, poses = flatten(q, state, self.axes, inputs_of(signals))
        return shape, with_lags(poses, signals)

    def _tip(self, q: ArrayLike, state: State, model: ErrorModel | None) -> Array:
        route = self._perfect_route if model is None else self._route
        return self._evaluated(q, state, model, lambda chunk, _: self._tips_along(route, chunk, model), 3)

    def _tips_along(
        self, route: Route | None, part: Poses, model: ErrorModel | None, turns: Turns | None = None
    ) -> Array:
        """The tip (3, n) by the route, but for poses at which small motions are large."""
        if route is None:
            return self._carried_tips(part, model)[:, 0]
        tip, largest = route.tips(part, turns)
        large = np.flatnonzero(largest >= SMALL)
        if large.size:
            tip[:, large] = self._carried_tips(part, model)[:, 0, large]
        return tip

    def _carried_tips(self, part: Poses, model: ErrorModel | None) -> Array:
        """The tip by any chain, with small motions of any size, (3, 1, n)."""
        return carried_tips(self._chain.at(part, model), self.tool, part.tool_length, self.workpiece_offset)

    def _pose(self, q: ArrayLike, state: State, model: ErrorModel | None) -> Array:
        def frames(chunk: Poses, _: slice) -> Array:
            return carried_frames(self._chain.at(chunk, model), self.tool, chunk.tool_length, self.workpiece_offset)

        rows = self._evaluated(q, state, model, frames, 3, 4)
        bottom = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*rows.shape[:-2], 1, 4))
        return np.concatenate([rows, bottom], axis=-2)

    def _evaluated(
        self,
        q: ArrayLike,
        state: State,
        model: ErrorModel | None,
        function: Callable[[Poses, slice], Array],
        *shape: int,
    ) -> Array:
        """A function of poses, and of which these are, that gives columns (*shape, n), over all: (..., *shape)."""
        leading, poses = self._poses(q, state, model)
        return poses_first(poses.evaluated(function, *shape), leading)


def dumps(machine: Machine) -> str:
    """The machine as the text of a machine file; `loads(dumps(machine)) == machine`."""
    head: dict[str, Any] = {"name": machine.name, "topology": machine.topology, "control": machine.control}
    for key, pair, default in (
        ("least_increment", machine.least_increment, DEFAULT_INCREMENT),
        ("max_correction", machine.max_correction, DEFAULT_CORRECTION),
    ):
        if pair != default:
            head[key] = {"linear": pair[0], "rotary": degrees(pair[1])}
    if machine.workpiece_offset != ORIGIN:
        head["workpiece_offset"] = machine.workpiece_offset
    blocks = [written("ncfix = 1", head), *(written(f"[axis.{axis.name}]", axis.file_keys()) for axis in machine.axes)]
    if machine.tool != GaugeLine():
        blocks.append(written("[tool]", {"direction": machine.tool.direction, "point": machine.tool.point}))
    blocks += [written("[[effect]]", effect.file_keys()) for effect in machine.effects]
    if machine.provenance:
        blocks.append(written("[provenance]", machine.provenance))
    return "\n\n".join(blocks) + "\n"
