"""The proof: every block of the original against the lines that replace it in the corrected program.

A block is proved if its text is unchanged except for the numbers of its path, and the corrected motion, followed by an
independent reader, brings the real tip to its intended place: at the end to half a digit of the control, on the way
within the tolerance. It is faulty if one of these is surely wrong, and not proved if this reader cannot tell.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator, Set
from dataclasses import replace

import numpy as np

from ncfix.arrays import Mask
from ncfix.certificate.coordinates import Given
from ncfix.certificate.expected import ProofTask, parts
from ncfix.certificate.findings import BlockFault, BlockProof
from ncfix.certificate.flow import LineOrder
from ncfix.certificate.following import MOST_TURNS, positions, skips
from ncfix.certificate.motions import UNSURE, MotionJudge
from ncfix.certificate.pairing import LinePair, LinePairs, Pairing, hole_faults, text_faults
from ncfix.certificate.reading import Family
from ncfix.certificate.steps import AxisStep, Kind
from ncfix.certificate.text import Indices, Text, same_but_axes
from ncfix.machine import Machine

PLAIN_STRATEGIES = frozenset(("rotary-then-linear", "position"))


def prove(
    original: bytes,
    corrected: bytes,
    machine: Machine,
    given: Given,
    dialect: str = "",
    tolerance_um: float = 1.0,
) -> BlockProof:
    """Compare a program with its correction for a machine.

    dialect       name of the dialect, which gives the family of the language; empty: found from the text
    tolerance_um  tolerance of the way; that of the stamp of the corrected program takes precedence
    """
    collects = gc.isenabled()
    gc.disable()  # there are no cycles to collect, but a million words that the collector would visit
    try:
        family = Family.of(original, dialect)
        first, second = Text.of(original, family), Text.of(corrected, family)
        if second.is_renumbered and not np.array_equal(second.block_numbers, first.block_numbers):
            first, second = first.without_block_numbers(), second.without_block_numbers()
        settings = positions(first, given) if b"/" in original else [given]
        turn = 0 if len(settings) == 1 and LineOrder.are_alike(first, second) else None
        prover, *others = (Prover(ProofTask(first, second, machine, each, tolerance_um, turn)) for each in settings)
        for more in range(1, min(max(prover.turns.values(), default=1), MOST_TURNS)):
            others.append(Prover(ProofTask(first, second, machine, given, tolerance_um, more)))
        pairing = prover.paired()
        for each in others:
            steps = ((row, prover.ours[row], each.ours[row]) for row in each.ours if row in prover.ours)
            prover.begin_apart |= {
                row for row, one, other in steps if (one.start, one.said) != (other.start, other.said)
            }
        proof = prover.run(pairing)
        for each in others:
            each.begin_apart = prover.begin_apart
            pairs = pairing.pairs.columns
            pairs = pairs[~np.isin(pairs[:, 0], list(each.left_out()))]
            joint = each.run(replace(pairing, pairs=LinePairs(pairs.ravel().tolist()), faults=[]))
            proof.join(joint, {first.lines[row].number for row in prover.ours})
        return proof
    finally:
        if collects:
            gc.enable()


class Prover(MotionJudge):
    """Judges the blocks of an original and its correction."""

    def paired(self) -> Pairing:
        """The pairs of original lines and the corrected lines that replace them."""
        moves, nearness = self.ours.__contains__, (self.leads_there, self.lead_there)
        holes = ((), ()) if self.first.family is Family.WORDS else (self.calls, self.calls_there)
        pairing = Pairing(self.first, self.second, *nearness, moves, self.is_followed, self._is_foreign, holes)
        pairing.run()
        return pairing

    def left_out(self) -> Iterator[int]:
        """The lines that are skipped, or that have no further execution for this prover to examine."""
        yield from (row for row, line in self.first.apart() if skips(self.given.skip, line))
        if self.turn:
            yield from (row for row in range(len(self.first.lines)) if self.turns.get(row, 1) <= self.turn)

    def run(self, pairing: Pairing) -> BlockProof:
        """Judge all blocks."""
        self._stamps()
        for fault in pairing.faults:
            if near := self._foreign_near(fault, pairing):
                self.proof.leave(UNSURE, near)
            else:
                self.proof.fault(*fault)
        pairs = pairing.pairs.columns
        plain = self._are_plain(pairs, pairing.unsure)
        self.proof.blocks += int(plain.sum())
        self.proof.motions += int(plain.sum())
        for k in np.flatnonzero(~plain).tolist():
            pair = pairing.pairs[k]
            line = self.first.lines[pair.row]
            if pair.row in pairing.unsure:
                unsure = self.ours.get(pair.row)
                self.proof.blocks += 1
                self.proof.motions += unsure is not None
                self.proof.leave((unsure and unsure.why) or UNSURE, line.number)
                continue
            self._text(pairing, pair)
            if not line.rest.strip() and not line.path:
                continue
            self.proof.blocks += 1
            step = self.ours.get(pair.row)
            self.proof.motions += step is not None
            if line.number in self.proof.faulty or line.number in self.proof.left:
                continue
            if step is None:
                if line.odd and self.changed(pair):
                    self.proof.leave(line.odd, line.number)
                elif line.path and self.first.family is not Family.KLARTEXT and self.changed(pair):
                    text = "the numbers of a line that moves nothing have changed"
                    self.proof.fault(text, self.second.lines[pair.first].number, line.number)
                else:
                    self.proof.proved += 1
                continue
            why = self._hindrance(step, pair)
            if why:
                self.proof.leave(why, line.number)
                self._roughly(step, pair)
            elif step.kind != Kind.FIXED:
                plain[k] = True
        self.proof.blocks += sum(1 for fault in pairing.faults if fault.original)
        for part in parts(np.flatnonzero(plain)):
            self.judge(*pairs[part].T)
        self.proof.faults.sort(key=lambda fault: fault.line)
        return self.proof

    def _are_plain(self, pairs: Indices, unsure: Set[int]) -> Mask:
        """(n,) which pairs (n, 3) are plain motions, replaced by one line that differs in numbers of axes only."""
        ours, first, second = self.ours, self.first.read, self.second.read
        row, at, last = pairs.T
        found: Mask = (at == last) & (ours.at[row] >= 0)
        if first is None or second is None or self.model is None or self.strategy not in (*PLAIN_STRATEGIES, "full"):
            return np.zeros(len(pairs), dtype=bool)
        known = ours.followed & (ours.kind <= Kind.FEED) & ~ours.unsteady & ~ours.foreign & np.isfinite(ours.length)
        known &= np.isfinite(ours.end).all(axis=1)
        if ours.tcp.any() and not self.model.leads:
            known &= ~ours.tcp
        found[found] = known[ours.at[row[found]]]
        for rows in (self.foreign, unsure):
            found &= ~np.isin(row, list(rows))
        found &= ~np.isin(self.first.numbers[row], [*self.proof.faulty, *self.proof.left])
        where = np.flatnonzero(found)
        found[where] = same_but_axes(first, row[where], second, at[where])
        return found

    # -- stamp and text -----------------------------------------------------------------------------------------------

    def _stamps(self) -> None:
        stamp = self.second.stamp
        if stamp is not None and stamp.machine != self.machine_hash:
            self.proof.fault("the stamp is of another machine, or of this machine file before a change", stamp.line, 0)
        if stamp is None and not self.first.says(self.second):
            self.proof.fault("the program has changed but has no stamp", 1, 0)

    def _text(self, pairing: Pairing, pair: LinePair) -> None:
        step = self.ours.get(pair.row)
        arc = step is not None and (step.kind == Kind.ARC or (bool(step.why) and len(step.named) < 9))
        line = self.second.lines[pair.first].number
        if self._is_foreign(pair.row):
            return
        number = self.first.lines[pair.row].number
        call = self.calls.get(pair.row)
        if call is not None and self.first.family is not Family.WORDS:
            faults = hole_faults(pairing, pair, call)
        else:
            faults = text_faults(pairing, pair, arc, timed=step is not None and step.feed_mode == 93)
        if call is not None and self.calls_otherwise(pair, call):
            faults.append("the call of the cycle has changed in more than the depth of its hole")
        for text in faults:
            self.proof.fault(text, line, number)

    def _foreign_near(self, fault: BlockFault, pairing: Pairing) -> int:
        """The original line near a fault, if a line there is unknown to this reader and may be its cause; else 0."""
        row = fault.original - 1
        if not fault.original:
            rows, _, last = pairing.pairs.columns.T
            row = int(rows[self.second.numbers[last] < fault.line].max(initial=0))
        near = range(max(row - 2, 0), min(row + 3, len(self.first.lines)))
        return row + 1 if any(self._is_foreign(at) or (at in self.ours and self.ours[at].why) for at in near) else 0

    def _is_foreign(self, row: int) -> bool:
        step = self.ours.get(row)
        return row in self.foreign or (step is not None and step.foreign)

    # -- what this reader can follow ----------------------------------------------------------------------------------

    def _hindrance(self, step: AxisStep, pair: LinePair) -> str:
        """Why a motion cannot be proved; "" if it can, or is judged here (a motion in machine coordinates)."""
        if step.why:
            return step.why
        if step.kind == Kind.FIXED:
            if self.changed(pair):
                line, number = self.second.lines[pair.first].number, self.first.lines[pair.row].number
                self.proof.fault("a motion in machine coordinates has changed", line, number)
            else:
                self.proof.proved += 1
                self.proof.proved_motions += 1
            return ""
        if self.model is None or (step.tcp and not self.model.leads):
            return "the machine does not have three linear axes that move the tip in all directions"
        if self.strategy not in PLAIN_STRATEGIES and self.strategy != "full":
            return f"the strategy {self.strategy} does not correct the tip position"
        if any(map(math.isnan, step.end)):
            return "the position of an axis is not known"
        if math.isnan(step.length):
            if step.tcp or self.machine.depends_on_tool_length:
                return "the length of the tool is not known"
            step.length = self.ours.length[self.ours.at[step.row]] = 0.0
        if step.unsteady:
            return "cutter radius compensation is on"
        return ""

    def _roughly(self, step: AxisStep, pair: LinePair) -> None:
        """Roughly judge a block that cannot be proved: its numbers must not change by more than the largest correction.

        The same holds for the place to which it leads, if that is known. Its way is not judged.
        """
        line, last = self.first.lines[pair.row], self.second.lines[pair.last]
        if line.odd or line.doubled() or step.foreign or pair.first != pair.last:
            return
        most = 2.5 * self.machine.max_correction[0] + 1e-6
        other = self.theirs.get(pair.last)
        if not step.why and other is not None and not other.why:
            off = np.where(self.machine.rotary, 0.0, np.abs(np.subtract(other.end, step.end)))
            if (off > most).any():
                axis = self.machine.axis_names[int(np.nanargmax(off))]
                self.proof.fault(f"{axis} has changed by more than a correction", last.number, line.number)
                return
        for word in line.path if step.kind != Kind.ARC else ():
            found = last.word(word.name)
            if word.name not in "XYZ" or found is None or word.value is None or found.value is None:
                continue
            if abs(found.value - word.value) * step.unit > most:
                self.proof.fault(f"{word.name} has changed by more than a correction", last.number, line.number)
                return
