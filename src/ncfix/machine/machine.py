"""The machine: its axes and errors, and the pose of the tool, nominal and actual, at axis positions."""

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
"""Least increment of linear axes, mm, and of rotary axes, rad: 1 um and 0.001 degree."""
DEFAULT_CORRECTION = (0.5, 0.05 * np.pi / 180)
"""Largest correction of linear axes, mm, and of rotary axes, rad, that is not refused: 0.5 mm and 0.05 degree."""


@frozen(slots=False)
class Machine:
    """A serial machine tool with its errors. Immutable; `replace` makes another.

    name              for people
    topology          as in the machine file, e.g. "w C B F X Y Z t"
    axes              from the workpiece to the foundation, then from the foundation to the tool
    tool              the end of the tool branch
    effects           the errors
    control           default control of the machine
    least_increment   (mm, rad) smallest step of a command
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

    # -- properties ---------------------------------------------------------------------------------------------------

    @property
    def axis_names(self) -> tuple[str, ...]:
        """The letters of the axes, in the order of the columns of q."""
        return tuple(axis.name for axis in self.axes)

    def axis(self, name: str) -> Axis | None:
        """The axis with this letter; None if there is none."""
        return next((axis for axis in self.axes if axis.name == name), None)

    def is_positioning(self, name: str) -> bool:
        """Whether an ISO 230-1 error motion is the positioning of its axis: EXX of X, EZW of a W along Z."""
        axis = self.axis(name[-1])
        return axis is not None and len(name) == 3 and axis.owns(name[1])

    @cached_property
    def rotary(self) -> Mask:
        """(n_axes,) whether each axis is rotary."""
        return np.array([axis.rotary for axis in self.axes], dtype=np.bool_)

    @cached_property
    def ranges(self) -> Array:
        """(n_axes, 2) lowest and highest position of each axis, mm and rad; infinite for an endless axis."""
        return np.array([axis.range for axis in self.axes], dtype=np.float64).reshape(-1, 2)

    @cached_property
    def is_perfect(self) -> bool:
        """Whether all coefficients of all effects are zero."""
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
        """12 hexadecimal digits that change with any value that a correction depends on.

        Names, control, uncertainties, provenance, pitches and effects that are zero do not change it.
        """
        effects = tuple(dataclasses.replace(effect, covariance=None) for effect in self.effects if effect.active)
        axes = tuple(dataclasses.replace(axis, pitch=None) for axis in self.axes)
        bare = self.replace(name="", control=None, provenance={}, effects=effects, axes=axes)
        return hashlib.sha256(dumps(bare).encode()).hexdigest()[:12]

    def known_from(self, notes: Mapping[str, Any]) -> Machine:
        """The machine with further provenance. The former source of its errors goes to the end of `earlier`."""
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
        """(n_axes,) the smallest distance over which errors may bend as each axis moves, mm or rad.

        That is the spacing of knots or table entries, an eighth of a period, range / (4 degree) of a polynomial; inf
        for an axis on which no error depends.
        """
        lengths = error_model.feature_lengths(self.axes, self.effects)
        lengths.flags.writeable = False
        return lengths

    def breakpoints(self, axis: str) -> Array:
        """(k,) positions of an axis at which an error has a kink or a jump, ascending, mm or rad.

        For an endless axis they repeat with every turn.
        """
        return self._breakpoints[self.axis_names.index(axis)].copy()

    @cached_property
    def _breakpoints(self) -> tuple[Array, ...]:
        return error_model.breakpoints(self.axes, self.effects)

    @cached_property
    def kinks(self) -> tuple[tuple[int, Array], ...]:
        """The axes (columns) with kinks or jumps of their errors, and their positions, see `error_model.kinks`."""
        return error_model.kinks(self.axes, self.effects, self._breakpoints)

    @cached_property
    def directed(self) -> tuple[int, ...]:
        """The axes (columns) on whose direction of motion an error depends."""
        found = {direction_axis(self.axes, effect) for effect in self.effects if effect.active}
        return tuple(sorted(found - {-1}))

    @property
    def depends_on_direction(self) -> bool:
        """Whether any error depends on the direction of motion of an axis."""
        return bool(self.directed)

    @cached_property
    def bow(self) -> DeviationBounds | None:
        """Bounds of how far the tip error may leave its chord on straight motions; None if not known."""
        return bow_of(self.axes, self.tool, self.effects)

    @cached_property
    def linear_ways(self) -> Array | None:
        """(3, 3) directions of X, Y and Z as columns, in the frame that rotary axes turn all of them together.

        None without these axes, or if a rotary axis between them turns only some of them.
        """
        names = [self.axis_names.index(name) for name in "XYZ" if name in self.axis_names]
        return self._perfect_route.ways_together(names) if len(names) == 3 else None

    @cached_property
    def at_zero(self) -> tuple[Array, Array]:
        """(3,) the tip of a perfect machine without a tool, all axes at zero, mm, workpiece frame.

        And (n_axes, 3) the derivative of the tip by each linear axis there, mm per mm; zeros for rotary axes.
        """
        nowhere, ways = np.zeros(len(self.axes)), np.zeros((len(self.axes), 3))
        ways[~self.rotary] = self.follows(nowhere, tuple(np.flatnonzero(~self.rotary).tolist())).T
        return self.tip(nowhere), ways

    # -- poses and their derivatives ----------------------------------------------------------------------------------

    def tip(self, q: ArrayLike, tool_length: ArrayLike = 0.0) -> Array:
        """(..., 3) the tip of a perfect machine in the workpiece frame, mm."""
        return self._tip(q, State(tool_length), None)

    def actual_tip(self, q: ArrayLike, state: State = State()) -> Array:  # noqa: B008
        """(..., 3) the tip of the machine with its errors in the workpiece frame, mm."""
        return self._tip(q, state, None if self.is_perfect else self._model)

    def gaps(self, meant: Array, done: Sequence[Array], state: State, tip: Array | None = None) -> list[Array]:
        """For each of `done`: (n, 3) the actual tip with the axes there minus the perfect tip at `meant`, mm.

        meant, done  (n, n_axes) axis positions; sines of equal rotary positions are computed once
        tip          (n, 3) the perfect tip, mm, if known
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
        """The positions of linear axes (columns `axes`: X, Y, Z) at which the actual tip is at `target`.

        q       (n, n_axes) positions to begin with; all other axes stay there
        target  (n, 3) mm; None: the tip of a perfect machine at q

        The rows of `Aim.place` are poses here, (n, 3).
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
        """`workpiece_from_tool` with errors: the exact composition of all finite motions, shape (..., 4, 4)."""
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
        """(..., 3, axes) derivative of the tip of a perfect machine by linear axes, mm per mm, workpiece frame."""
        route = self._perfect_route

        def ways(chunk: Poses, _: slice) -> Array:
            n = chunk.positions.shape[1]
            found = [[np.broadcast_to(along, n) for along in way] for way in route.ways(axes, route.turns(chunk))]
            return np.array(found).reshape(len(axes), 3, n).swapaxes(0, 1)

        return self._evaluated(q, State(), None, ways, 3, len(axes))

    def xyz_for_tip(
        self, q: ArrayLike, axes: tuple[int, ...], target: ArrayLike, tool_length: ArrayLike = 0.0
    ) -> Array:
        """(n, 3) positions of X, Y and Z (columns `axes`) of a perfect machine with the tip at `target` (n, 3), mm.

        q  (n, n_axes) positions of all other axes

        Only for machines with `linear_ways` that span space.
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
        """(..., n_joints, 6) the error twist of each joint to first order: [ex ey ez ea eb ec], mm and rad.

        It is given in the joint's error axes, at its reference point, and includes location errors. The last joint is
        the spindle. `jacobians(q).joints` times it is `error(q)` up to second-order terms.
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
        """(..., 6, k) the derivative of `error` by the coefficients of effects, at zero error.

        effects  any effects of the joints of this machine; None: its own. The columns are their coefficients in turn;
                 the values of these do not matter.
        """
        shape, found = self._design(q, state, self.effects if effects is None else tuple(effects))
        return poses_first(found, shape)

    def design_columns(
        self, q: Array, state: State, effects: Sequence[Effect], responses: linear.UnitResponses | None = None,
        rows: int = 6,
    ) -> Array:  # fmt: skip
        """(rows, k, n) like the first rows of `design` for q (n, n_axes), but with poses last: faster for many effects.

        responses  `unit_responses` of the same poses, for several designs
        """
        return self._design(q, state, tuple(effects), responses, rows)[1]

    def unit_responses(self, q: Array, state: State) -> linear.UnitResponses:
        """The responses of the tool pose to single errors at these poses."""
        return linear.UnitResponses(self.axes, self.tool, self._with_signals(q, state, frozenset())[1])

    def _design(
        self, q: ArrayLike, state: State, effects: tuple[Effect, ...],
        responses: linear.UnitResponses | None = None, rows: int = 6,
    ) -> tuple[tuple[int, ...], Array]:  # fmt: skip
        """The common leading shape, and the design with poses last, (rows, k, n)."""
        shared = linear.Dependences.of(self.axes, effects)
        shape, poses = self._with_signals(q, state, shared.signals)
        responses = responses or linear.UnitResponses(self.axes, self.tool, poses)
        return shape, linear.design([each[:rows] for each in responses.of(effects)], shared, poses)

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
        """(3, n) the tip by the route; by the chain for poses at which small motions are large, or without a route."""
        if route is None:
            return self._carried_tips(part, model)[:, 0]
        tip, largest = route.tips(part, turns)
        large = np.flatnonzero(largest >= SMALL)
        if large.size:
            tip[:, large] = self._carried_tips(part, model)[:, 0, large]
        return tip

    def _carried_tips(self, part: Poses, model: ErrorModel | None) -> Array:
        """(3, 1, n) the tip by the chain, which allows small motions of any size."""
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
        """(..., *shape) the values of a function of poses and their slice, which returns (*shape, n), at all poses."""
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
