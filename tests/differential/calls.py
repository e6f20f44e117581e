"""All canonical calls that are no motions: same order, same words, at the same place among the motions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from differential import paths
from differential.canon import ARC, RAPID, Canon
from differential.canon_text import Call, Floats
from differential.segment import Fate, Segments

STAMP = "ncfix"
OFFSETS = {"SET_G92_OFFSET", "SET_G5X_OFFSET"}
FEED_SLACK = 1e-3
"""Relative, of the time of a block: what the design allows an F of inverse time with few digits."""
PRINTED = 1e-4  # of a feed
LARGEST = 0.1  # mm: more than any correction here; an offset may be older than the position, whose ends are judged


@dataclass(frozen=True, slots=True)
class _Place:
    """A call and the number of original motions that are done before it; `inside`: while one is under way."""

    call: Call
    after: int
    inside: bool


def compare(original: Canon, fixed: Canon, segments: Segments) -> Iterator[tuple[int, str]]:
    """(line, complaint) for every difference, at most three of each kind."""
    yield from list(_other_calls(original, fixed, segments))[:3]
    yield from list(_feeds(original, fixed, segments))[:3]


def _other_calls(original: Canon, fixed: Canon, segments: Segments) -> Iterator[tuple[int, str]]:
    before = [_Place(call, call.after, False) for call in original.calls if _counts(call)]
    after = [_placed(call, segments) for call in fixed.calls if _counts(call)]
    for one, two in zip_longest(before, after):
        place = (one or two).after  # type: ignore[union-attr]
        line = int(original.line[min(place, len(original) - 1)]) if len(original) else 0
        if one is None or two is None:
            known, found = (one or two), "missing" if two is None else "new"
            yield line, f"{found} call {known.call.name}({known.call.arguments})"  # type: ignore[union-attr]
            return
        if (one.call.name, one.after) != (two.call.name, two.after) or two.inside:
            yield line, f"{one.call.name} after {one.after} motions became {two.call.name} after {two.after}"
            return
        if not _same_arguments(one.call, two.call, original, fixed):
            yield line, f"{one.call.name}({one.call.arguments}) became ({two.call.arguments})"


def _counts(call: Call) -> bool:
    """Feeds are compared motion by motion; the stamp is the one comment that may be new."""
    return call.name != "SET_FEED_RATE" and not (call.name == "COMMENT" and STAMP in call.arguments.lower())


def _placed(call: Call, segments: Segments) -> _Place:
    done = int(np.searchsorted(segments.last, call.after, side="left"))
    inside = done < len(segments.first) and segments.first[done] < call.after <= segments.last[done]
    return _Place(call, done, bool(inside))


def _same_arguments(one: Call, two: Call, original: Canon, fixed: Canon) -> bool:
    """Offsets that are set from the current position follow the corrected position; all else is equal."""
    if one.arguments == two.arguments:
        return True
    if one.name not in OFFSETS or one.after == 0 or two.after == 0:
        return False
    moved = np.abs(fixed.end[two.after - 1] - original.end[one.after - 1]).max() * np.sqrt(2) + LARGEST
    first, second = (np.array([float(value) for value in call.arguments.split(",")]) for call in (one, two))
    return bool(np.all(np.abs(first - second) <= moved + 3e-3))


def _feeds(original: Canon, fixed: Canon, segments: Segments) -> Iterator[tuple[int, str]]:
    """Each piece runs at the feed of its motion; with inverse time all the pieces together take its time.

    So they do where only rotary axes turn: F is degrees a minute then, but mm a minute as soon as X Y Z move too. In
    which mode such a turn is written does not matter: a slow one of G93 may need G94, where its F has digits enough.
    """
    wanted, before = _feed_of(original)
    given, after = _feed_of(fixed)
    old, new = _length(original), _length(fixed)
    pace, paces = _pace(original, wanted), _pace(fixed, given)
    turns = (np.linalg.norm((original.end - original.start)[:, :3], axis=1) < 1e-9) & (old > 0)
    for k, (first, last) in enumerate(zip(segments.first, segments.last, strict=True)):
        if segments.fate[k] in (Fate.WRONG, Fate.CONTOUR) or original.kind[k] == RAPID:
            continue
        pieces = range(first, last + 1)
        if not turns[k] and any(after[j] != before[k] for j in pieces):
            yield int(original.line[k]), "the feed mode changed"
        elif not before[k] and not turns[k]:
            other = next((given[j] for j in pieces if abs(given[j] - wanted[k]) > 1e-4), None)
            if other is not None:
                yield int(original.line[k]), f"feed {wanted[k]:g} became {other:g}"
        elif min(wanted[k], *(given[j] for j in pieces)) > 0:
            time, total = old[k] / pace[k], sum(new[j] / paces[j] for j in pieces)
            allowed = time * (FEED_SLACK + sum(PRINTED / given[j] for j in pieces))
            detour = abs(sum(new[j] for j in pieces) - old[k]) / pace[k]  # of motions that are hardly any
            if abs(total - time) > allowed + detour:
                yield (
                    int(original.line[k]),
                    f"{time * 60:g} s for {'a turn' if turns[k] else 'inverse time'}: {total * 60:g} s",
                )


def _pace(canon: Canon, feeds: list[float]) -> Floats:
    """(n,) feeds in mm a minute, or as they are where only rotary axes turn.

    The control takes F in the length unit in force where F stands, and in degrees whatever that unit is.
    """
    inch = np.zeros(len(canon), dtype=bool)
    unit, inch_feed = False, False
    position = 0
    for call in (*canon.calls, Call("END", "", len(canon))):
        inch[position : call.after] = inch_feed
        position = call.after
        if call.name == "USE_LENGTH_UNITS":
            unit = "INCHES" in call.arguments
        elif call.name == "SET_FEED_RATE":
            inch_feed = unit
    linear = np.linalg.norm((canon.end - canon.start)[:, :3], axis=1) > 1e-9
    pace: Floats = np.array(feeds) * np.where(inch & (linear | (canon.kind == ARC)), 25.4, 1.0)
    return pace


def _length(canon: Canon) -> Floats:
    """(n,) what the control takes for the length of a motion: along X Y Z, or if it has none, the angle turned."""
    rows = np.arange(len(canon))
    way = canon.end - canon.start
    linear, turn = np.linalg.norm(way[:, :3], axis=1), np.linalg.norm(way[:, 3:6], axis=1)
    arcs = rows[canon.kind == ARC]
    if arcs.size:
        radius = np.linalg.norm(np.cross(canon.start[arcs, :3] - canon.centre[arcs], canon.normal[arcs]), axis=1)
        height = np.sum(way[arcs, :3] * canon.normal[arcs], axis=1)
        linear[arcs] = np.hypot(radius * paths.sweep(canon, arcs), height)
    length: Floats = np.where(linear > 1e-9, linear, turn)
    return length


def _feed_of(canon: Canon) -> tuple[list[float], list[bool]]:
    """The feed and whether it is inverse time, for every motion."""
    feed, inverse, position = 0.0, False, 0
    feeds: list[float] = []
    modes: list[bool] = []
    for call in (*canon.calls, Call("END", "", len(canon))):
        feeds += [feed] * (call.after - position)
        modes += [inverse] * (call.after - position)
        position = call.after
        if call.name == "SET_FEED_RATE":
            feed = float(call.arguments)
        elif call.name == "COMMENT" and "feed mode set to" in call.arguments:
            inverse = "inverse time" in call.arguments
    return feeds, modes
