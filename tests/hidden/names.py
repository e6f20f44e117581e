"""When a reported name means a hidden effect.

A name is read by its words, not by its spelling: an ISO 230-1 symbol (`EYX`), a kind ("backlash", "spindle growth";
the words of each kind are in KINDS), and an axis (the field `axis` of the report, the symbol's, or a lone letter in
the name).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

KINDS = {
    "pitch": r"screw|cyclic|periodic|pitch error|pitch [XYZ]$",
    "backlash": r"backlash|reversal|lost motion|wind-?up",
    "lateral play": r"play",
    "angular play": r"play",
    "radial": r"radial|eccentric|run-?out|ovality",
    "axial": r"axial|face",
    "wobble": r"wobble",
    "encoder": r"encoder",
    "worm": r"worm|gear",
    "rotary seat": r"rotary seat|seat",
    "table stiffness": r"stiffness|anisotrop",
    "unbalanced load": r"unbalanc|imbalanc",
    "gravity sag": r"gravity|(trunnion|swivel|head|rotary) sag",
    "trunnion twist": r"trunnion twist",
    "bed sag": r"bed sag",
    "ram droop": r"ram (droop|sag)",
    "column nod": r"column nod|nod",
    "foundation tilt": r"foundation",
    "tool droop": r"(tool|holder).*(droop|weight|bend)",
    "spindle growth": r"(spindle|tool|thermal).*growth",
    "drift": r"drift",
    "thermal scale": r"thermal (scale|expansion|gain)|scale.*temperature",
    "thermal bend": r"thermal bend|bending",
    "rotary centre drift": r"(rotary|centre|center).*drift",
    "ambient swing": r"ambient|daily",
    "artefact growth": r"art[ei]fact|workpiece (growth|expansion)",
    "table active": r"already (active|on)|table active|double compensation",
    "wrong sign": r"wrong sign|sign of (the )?(table|compensation|model)|doubled",
    "stale table": r"stale|shifted|old table|outdated",
    "rotary sign": r"rotary sign|sign of (axis|rotary)|(wrong|reversed).*(rotary|rotation|sense)",
    "degree": r"degree|radian",
    "pivot": r"pivot",
    "inch": r"inch",
    "cable drag": r"cable|hose",
    "slip": r"slip|re-?zero|crash",
}
BY_SYMBOL = ("radial", "axial", "wobble", "encoder", "worm")
ALSO = {kind: {"pitch"} for kind in BY_SYMBOL} | {
    "table stiffness": {"wobble"},
    "bed sag": {"ram droop"},
    "ram droop": {"bed sag"},
    "gravity sag": {"unbalanced load"},
}
ALONG = ("drift", "ambient swing")
_SYMBOL = re.compile(r"\bE([XYZABC])(0?)([A-Z])\b")


@dataclass(frozen=True, slots=True)
class Named:
    """What a truth file says of one hidden effect, as far as names go."""

    name: str
    kind: str
    axis: str
    symbols: tuple[str, ...]
    family: str


class Nameable(Protocol):
    """An entry of the catalogue."""

    name: str
    kind: str
    axis: str
    symbols: tuple[str, ...]
    family: str


def named(entry: Nameable) -> Named:
    """Its names."""
    return Named(entry.name, entry.kind, entry.axis, entry.symbols, entry.family)


def matches(truth: Named, name: str, title: str = "", axis: str | None = None) -> bool:
    """Whether a reported name (with its title and axis, where the report has them) means the hidden effect.

    A bare symbol is a curve of that component; it also names the error motions of a rotary axis, whose orders are one
    name. A table that is softer one way is contained in the wobble of that table, twice per turn. A sag with its slope
    is one effect, whether the slide is a bed or a ram: the machine file does not say which. A swivel that turns under
    its weight and load is out of balance.
    """
    if name.strip().lower() == truth.name.lower() and truth.kind != "curve":
        return True
    symbols = {match.group(0) for match in _SYMBOL.finditer(f"{name} {title}")}
    kinds = kinds_of(name) or kinds_of(title)
    if truth.axis and not _axis_fits(truth, name, symbols, axis):
        return False
    shared = bool(symbols & set(truth.symbols))
    if truth.kind == "curve" or (truth.kind in BY_SYMBOL and not kinds):
        return shared and not kinds
    if truth.kind in ("lateral play", "angular play"):
        return truth.kind in kinds and shared
    return bool(kinds & ({truth.kind} | ALSO.get(truth.kind, set())))


def kinds_of(text: str) -> set[str]:
    """Every kind that a text speaks of; where two share a word, the more special one."""
    found = {kind for kind, words in KINDS.items() if re.search(rf"\b(?:{words})", text, re.IGNORECASE)}
    for special, general in (
        ("rotary centre drift", "drift"),
        ("rotary sign", "wrong sign"),
        ("spindle growth", "tool droop"),
    ):
        if special in found:
            found.discard(general)
    return found


def _axis_fits(truth: Named, name: str, symbols: set[str], axis: str | None) -> bool:
    """The field `axis` decides; without it a symbol's axis (its direction, for a drift along a base axis) or a lone
    letter.
    """
    if axis:
        return axis.strip().upper() == truth.axis
    place = 1 if truth.kind in ALONG else -1
    said = {symbol[place] for symbol in symbols} | set(re.findall(r"\b[A-Z]\b", name))
    return truth.axis in said
