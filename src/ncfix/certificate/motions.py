"""The second reader: whether corrected motions bring the tip to its intended place, at their ends and on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ncfix.arrays import Mask
from ncfix.certificate.deviations import ASIDE, FEW, HALF_TURN, MANY, NO_ANSWER, Deviations, Moved
from ncfix.certificate.expected import SLACK, WHOLE_TURN, ProofTask
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.following import NO_CENTRE, NO_POLE
from ncfix.certificate.model import Ways
from ncfix.certificate.pairing import LinePair
from ncfix.certificate.reading import Family
from ncfix.certificate.steps import NO_CIRCLE, AxisStep, Kind
from ncfix.certificate.text import Indices

TURNED = 1e-9
"""Difference, rad, up to which rotary positions agree; `SLACK` for linear ones."""
AS_IF = 4e-4
"""Allowance, mm, if the place of an axis is not known: the others are corrected as if it stood in its place."""
OFF = "{} ends {} from the corrected position"
UNSAID = "the program has not yet given the position of an axis"
BY_VECTOR = "the path of a motion in which the tool turns in a plane (PATHCTRL VECTOR)"
LEFT = "left unchanged"
UNSURE = "the block of some added lines is not known"


class MotionJudge(Deviations):
    """Judges motions that this reader can follow; the results are added to `proof`."""

    def __init__(self, task: ProofTask) -> None:
        super().__init__(task)
        self.turn = task.turn or 0
        self.machine_hash = task.machine.hash
        self.proof = BlockProof(stamp=task.second.stamp)
        self.polar: set[int] = set()
        if task.second.family is Family.KLARTEXT:
            self.polar = {row for row, line in task.second.apart() if line.word("PA")}
        """Lines of the corrected program with an angle about a pole, whose digits limit the accuracy of the place."""
        self.begin_apart: set[int] = set()
        """Motions that begin elsewhere in another position of block delete, or in another execution of their line:
        `fix` does not split them, and rapids may leave axes without a word where they stand."""

    def changed(self, pair: LinePair) -> bool:
        """Whether a line has changed at all."""
        return pair.first != pair.last or not self.first.lines[pair.row].says(self.second.lines[pair.first])

    def judge(self, row: Indices, first: Indices, last: Indices) -> None:
        """Judge motions that this reader can follow, given as columns of `LinePair`."""
        before = self.theirs.before
        moved = Moved(row, first, last, self.ours.at[row], before[first], before[last + 1])
        whole = self._are_whole(moved)
        for pair in moved.where(~whole).pairs():
            self._incomplete(pair)
        moved = moved.where(whole)
        good = self._right_ends(moved) & self._same_pace(moved)
        rest = np.flatnonzero(~good)
        for k, pair in zip(rest.tolist(), moved.where(rest).pairs(), strict=True):
            step, pieces = self.ours[pair.row], self._pieces_of(pair)
            line, number = self.second.lines[pair.last].number, self.first.lines[pair.row].number
            verdict, proved = self._end(step, pieces, pair)
            if verdict and proved:
                self.proof.leave(verdict, number)
            elif verdict:
                self.proof.fault(verdict, line, number)
            elif pace := self._pace(step, pieces):
                self.proof.fault(pace, line, number)
            else:
                good[k] = True
        self._ways(moved.where(good))

    def _pieces_of(self, pair: LinePair) -> list[AxisStep]:
        return [self.theirs[row] for row in range(pair.first, pair.last + 1) if row in self.theirs]

    def _are_whole(self, moved: Moved) -> Mask:
        """(m,) whether all that is needed to judge a motion is known, of itself and of its pieces."""
        theirs = self.theirs
        unknown = ~theirs.followed | ~np.isfinite(theirs.end).all(axis=1)
        counts = np.concatenate([[0], np.cumsum(unknown)])
        whole = (counts[moved.stop] == counts[moved.begin]) & self.sure[moved.ours] & (moved.stop > moved.begin)
        if self.machine.depends_on_direction:
            whole &= self.one_sided[moved.ours]
        kind, pieces = self.ours.kind[moved.ours][moved.owner], theirs.kind[moved.pieces]
        whole[moved.owner[(pieces != kind) & ~((kind == Kind.ARC) & (pieces == Kind.FEED))]] = False
        found: Mask = whole
        return found

    def _incomplete(self, pair: LinePair) -> None:
        """Note why a motion cannot be judged, or the fault of its pieces."""
        step, number = self.ours[pair.row], self.first.lines[pair.row].number
        line, pieces = self.second.lines[pair.last].number, self._pieces_of(pair)
        broken = next((piece.why for piece in pieces if piece.why in (NO_POLE, NO_CENTRE, NO_CIRCLE)), "")
        if broken:
            self.proof.fault(broken, line, number)
        elif why := self.unfollowed(step, pieces):
            self.proof.leave(why, number)
        else:
            self.proof.fault("the block does not make the same motion as before", line, number)

    def _right_ends(self, moved: Moved) -> Mask:
        """(m,) whether the ends of motions are surely right; the others are judged by `_end`."""
        if not len(moved.row) or self.strategy == "full" or self.model is None:
            return np.zeros(len(moved.row), dtype=bool)
        ours = self.ours
        meant, done = self.ends(ours, moved.ours), self.ends(self.theirs, moved.stop - 1)
        expected = self.expected[moved.ours]
        rotary, (low, high) = self.machine.rotary, self.machine.ranges.T
        single = moved.stop - moved.begin == 1
        units = ours.unit[moved.ours]
        written = np.where(single[:, None], ours.written[moved.ours], 0).astype(np.intp)
        halves = self.along(self.halves(units, written), moved.ours)
        right = (np.abs(done - expected) <= halves * 1.002 + np.where(rotary, TURNED, SLACK)).all(axis=1)
        right &= (ours.said[moved.ours] | rotary).all(axis=1)
        added = np.where(rotary, 0.0, np.abs(done - meant))
        least = np.where(rotary, np.inf, self.machine.least_increment[0] / 2)
        right &= (added <= self.machine.max_correction[0] + least).all(axis=1)
        there, tcp = done, ours.tcp[moved.ours]
        if tcp.any():
            there = self.model.joints(done, tcp, np.nan_to_num(ours.length[moved.ours]))
        right &= ((there >= low) & (there <= high)).all(axis=1)
        self.proof.largest_um = max(self.proof.largest_um, 1e3 * float(added[right].max(initial=0.0)))
        found: Mask = right
        return found

    def _same_pace(self, moved: Moved) -> Mask:
        """(m,) whether all pieces of a motion have the feed of the original."""
        ours, theirs, owner, pieces = self.ours, self.theirs, moved.owner, moved.pieces
        feed, mode = ours.feed[moved.ours][owner], ours.feed_mode[moved.ours][owner]
        alike = (feed == theirs.feed[pieces]) | (np.isnan(feed) & np.isnan(theirs.feed[pieces]))
        alike &= mode == theirs.feed_mode[pieces]
        alike &= (mode != 93) | (moved.stop - moved.begin == 1)[owner]
        same = np.ones(len(moved.row), dtype=bool)
        same[owner[~alike]] = False
        return same

    def _end(self, step: AxisStep, pieces: Sequence[AxisStep], pair: LinePair) -> tuple[str, bool]:
        """The fault of the end of a motion, "" if it has none; and whether the block then counts as not proved only."""
        assert self.model is not None
        at = self.ours.at[step.row]
        done = self.ends(self.theirs, self.theirs.at[pieces[-1].row])
        meant, expected = self.ends(self.ours, at), self.expected[at]
        rotary = self.machine.rotary
        full = self.strategy == "full" and bool(rotary.any())
        if full:
            if (np.abs(done - meant)[rotary] > self.machine.max_correction[1] + 1e-6).any():
                return UNSURE, True
            tcp, length = np.array([step.tcp]), np.array([step.length])
            side = self.directions[at][None].astype(np.float64)
            expected = self.model.aimed(meant[None], tcp, length, side, done[None])[0]
            expected = np.where(rotary, done, expected)
        said = np.array(step.said) | (rotary if not full else False)  # no other strategy turns rotary axes
        if step.kind == Kind.RAPID and pair.row in self.begin_apart:
            said &= [name in step.named for name in self.machine.axis_names] if step.turn is None else False
        off = np.where(said, np.abs(done - expected), 0.0)
        loose = full or any(row in self.polar for row in range(pair.first, pair.last + 1))
        loose = loose or abs(step.sweep) > WHOLE_TURN
        if not said.all() and self.changed(pair):
            near, turned = self.machine.max_correction if loose else (AS_IF, TURNED)
            most = self.half_steps(step, added=True) + np.where(rotary, turned, near)
            return (UNSAID, True) if (off <= most).all() else (OFF.format(*self.worst(off, most)), False)
        anew = self.first.family is Family.KLARTEXT and step.kind is Kind.ARC  # a C or CP may have become a CR
        whole = pieces[0] if len(pieces) == 1 else None
        halves = self.half_steps(step, whole, added=anew or whole is None)
        allowed = halves * 1.002 + np.where(rotary, TURNED, self.tolerance if loose else SLACK)
        added = np.where(said & ~rotary, np.abs(done - meant), 0.0)
        if (off > allowed).any() and (off > allowed + self.unrounded(step, pieces[-1])).any():
            if not self.changed(pair):
                return LEFT, True
            return OFF.format(*self.worst(off, allowed)), False
        if (added > self.machine.max_correction[0] + self.half_steps(step, added=True)).any():
            return "a correction is larger than the machine file allows", False
        low, high = self.machine.ranges.T
        inside, there = meant, done
        if step.tcp:
            tcp, length = np.array([True, True]), np.array([step.length] * 2)
            inside, there = self.model.joints(np.stack([meant, done]), tcp, length)
        if (((there < low - 1e-6) | (there > high + 1e-6)) & (inside >= low) & (inside <= high) & said).any():
            return "the corrected motion leaves the travel of an axis", False
        self.proof.largest_um = max(self.proof.largest_um, 1e3 * float(added.max()))
        return (UNSAID, True) if not said.all() else ("", False)

    def _pace(self, step: AxisStep, pieces: Sequence[AxisStep]) -> str:
        """The fault of the feed, "" if it has none; a turn of rotary axes alone may get another feed."""
        if len(pieces) == 1 and (pieces[0].feed, pieces[0].feed_mode) == (step.feed, step.feed_mode):
            return ""
        if step.kind not in (Kind.FEED, Kind.ARC):
            return ""
        turn = all(name in "ABC" for name in step.named)
        if turn or step.feed is None or any(piece.feed is None for piece in pieces):
            return ""
        feeds = [piece.feed or 0.0 for piece in pieces]
        if any(piece.feed_mode != step.feed_mode for piece in pieces):
            return "" if turn else "the unit of the feed rate has changed"
        if step.feed_mode == 93:
            ours = 1 / step.feed if step.feed else math.inf
            theirs = sum(1 / feed if feed else math.inf for feed in feeds)
            return "" if abs(theirs - ours) <= 2e-3 * ours else "the pieces have another duration than the block"
        return "" if all(feed == step.feed for feed in feeds) else "the feed has changed"

    def _ways(self, moved: Moved) -> None:
        """Judge the ways of motions with right ends."""
        self.proof.proved += len(moved.row)
        self.proof.proved_motions += len(moved.row)
        kinds = self.ours.kind[moved.ours]
        known = np.isfinite(self.ours.start[moved.ours]).all(axis=1)
        known &= np.isfinite(self.theirs.start[moved.begin]).all(axis=1)
        cutting = moved.where(known & ((kinds == Kind.FEED) | (kinds == Kind.ARC)))
        if not len(cutting.row) or self.model is None:
            return
        owner, counts = cutting.owner, cutting.stop - cutting.begin
        meant, done = Ways.of(self.model, self.ours, cutting.ours), Ways.of(self.model, self.theirs, cutting.pieces)
        _, tcp, length, direction = self.columns(cutting.ours)
        last = np.cumsum(counts) - 1
        share = np.ones(len(owner))
        inner = np.setdiff1d(np.arange(len(owner)), last)
        if inner.size:
            share[inner] = self.shares(meant, done, owner, inner, (tcp, length, direction))
        before = np.concatenate([[0.0], share[:-1]])
        before[np.concatenate([[0], last[:-1] + 1])] = 0.0
        bad: dict[int, str] = {}
        for k in inner[share[inner] < before[inner] - 1e-2].tolist():
            bad.setdefault(int(owner[k]), "the pieces of the block are not in sequence")
        given = (tcp, length, direction)
        allowed = self.allowed(cutting.ours)[owner]
        opens = np.concatenate([[0], last[:-1] + 1])
        allowed[opens] += self.gaps(meant.start, done.start[opens], np.arange(len(cutting.row)), given)
        counts = np.where(done.is_short(self.machine.rotary), FEW, MANY)
        first = np.cumsum(counts) - counts
        each = np.repeat(np.arange(len(owner)), counts)
        part = (np.arange(len(each)) - first[each] + 1) / (counts + 1)[each]
        at = before[each] + part * (share - before)[each]
        gap = np.maximum.reduceat(self.gaps(meant.at(owner[each], at), done.at(each, part), owner[each], given), first)
        if inner.size:
            places = self.gaps(meant.at(owner[inner], share[inner]), done.end[inner], owner[inner], given)
            gap[inner] = np.maximum(gap[inner], places)
        for k in np.flatnonzero(~(gap <= allowed)).tolist():
            text = f"the tip leaves the intended path by {1e3 * gap[k]:.2f} um between the ends of the block"
            bad.setdefault(int(owner[k]), text if math.isfinite(gap[k] - allowed[k]) else NO_ANSWER)
        aside = self.aside(cutting.ours)
        for k in np.flatnonzero(aside > ASIDE).tolist():
            bad[k] = ""
        good = ~np.isin(owner, list(bad))
        if good.any():
            self.proof.farthest_um = max(self.proof.farthest_um, 1e3 * float(gap[good].max()))
        for k, text in sorted(bad.items()):
            (pair,) = cutting.where(np.array([k])).pairs()
            self.proof.proved -= 1
            self.proof.proved_motions -= 1
            number = self.first.lines[pair.row].number
            if why := NO_ANSWER if text is NO_ANSWER else self._excuse(pair, float(aside[k])):
                self.proof.leave(why, number)
            else:
                self.proof.fault(text, self.second.lines[pair.first].number, number)

    def _excuse(self, pair: LinePair, aside: float) -> str:
        """The reason why a way beyond the tolerance counts as not proved, not as faulty; "" if it is faulty.

        aside  deviation, rad, of the tool, with evenly turning axes, from the plane in which the control turns it
        """
        if aside > ASIDE:
            return BY_VECTOR
        if not self.changed(pair):
            return LEFT
        if pair.first == pair.last:
            step, (low, high) = self.ours[pair.row], self.machine.ranges.T
            turn = np.abs(np.subtract(step.end, step.start))
            if aside:
                return BY_VECTOR
            if pair.row in self.begin_apart:
                return "the path of a motion that may begin at several positions"
            if (turn >= HALF_TURN)[self.machine.rotary & (high - low >= 2 * math.pi)].any():
                return "a rotary axis may turn in the other direction"
        if self.strategy == "full" or self.machine.depends_on_direction:
            why = "backlash" if self.machine.depends_on_direction else "rotary axes are corrected, too"
            return f"the path of a motion: {why}"
        return ""
