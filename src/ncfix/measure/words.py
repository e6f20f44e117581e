"""Identifiability in words."""

from __future__ import annotations

from collections.abc import Sequence

from ncfix.diagnostics import Message
from ncfix.measure.solve import Combination, Solution

ALIKE = 0.02
"""Factors this near to 1 or -1 count as such."""


def remarks(solution: Solution, labels: Sequence[str]) -> list[Message]:
    """What could not be told, and what was found instead."""
    found = _unseen(_listed(solution.unseen, labels), "nothing that was measured depends on")
    found += _unseen(_listed(solution.set_up, labels), "the unknown set-up takes the place of")
    found += [_combined(combination, labels) for combination in solution.combinations]
    if weak := _listed(solution.weak, labels):
        are = "is held as it is" if len(weak) == 1 else "are held as they are"
        text = f"{', '.join(weak)} {are}: these measurements would tell it to no better than what is much"
        found.append(Message("NCF620", text, hint="measure where it acts: `ncfix plan`"))
    if solution.condition > 1e4:
        text = f"the estimates depend strongly on one another: condition {solution.condition:.0f}"
        found.append(Message("NCF638", text, hint="measure at more varied poses, or estimate fewer effects"))
    return found


def _unseen(names: Sequence[str], why: str) -> list[Message]:
    if not names:
        return []
    are, them = ("is held as it is", "it") if len(names) == 1 else ("are held as they are", "them")
    return [Message("NCF632", f"{', '.join(names)} {are}: {why} {them}")]


def _listed(held: Sequence[int], labels: Sequence[str]) -> list[str]:
    """The coefficients by their names; where all of an effect's are held, the effect by its own."""
    free = {name.split()[0] for k, name in enumerate(labels) if k not in set(held)}
    names = [labels[k] for k in held]
    return list(dict.fromkeys(name if name.split()[0] in free else name.split()[0] for name in names))


def _combined(combination: Combination, labels: Sequence[str]) -> Message:
    held = labels[combination.held]
    names = [labels[k] for k in combination.others]
    hint = "`ncfix plan --separate` finds poses that tell them apart"
    if len(names) > 4:
        text = f"{held} and {', '.join(names[:4])} and {len(names) - 4} more: only combinations; {held} is held"
        return Message("NCF631", text, hint=hint)
    listed = f"{', '.join([held, *names[:-1]])} and {names[-1]}"
    return Message("NCF631", f"{listed}: only {_what(combination, held, names)}; {held} is held as it is", hint=hint)


def _what(combination: Combination, held: str, names: Sequence[str]) -> str:
    """What of a combination is determined: each of the others plus its factor times the held one."""
    if len(names) > 1:
        parts = [f"{name} {_times(factor)} {held}" for name, factor in zip(names, combination.factors, strict=True)]
        return " and ".join(parts)
    factor = combination.factors[0]
    if abs(factor - 1) < ALIKE:
        return "their sum"
    if abs(factor + 1) < ALIKE:
        return "their difference"
    return f"{names[0]} {_times(factor)} {held}"


def _times(factor: float) -> str:
    sign = "+" if factor > 0 else "-"
    return sign if abs(abs(factor) - 1) < ALIKE else f"{sign} {abs(factor):.3g} x"
