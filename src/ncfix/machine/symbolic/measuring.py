"""What measuring the tool tip can tell about the errors, and in which order, as one text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ncfix.machine.symbolic.derivation import Derivation
from ncfix.machine.symbolic.identify import identifiable
from ncfix.machine.symbolic.protocol import equations, protocol, report


def measuring(derivation: Derivation, vary: Iterable[str] = ()) -> str:
    """Rank and inseparable combinations, without and with lengths varied (`vary`), then a protocol of differences."""
    return "".join(_parts(derivation, list(vary)))


def _parts(derivation: Derivation, vary: list[str]) -> Iterator[str]:
    chain = derivation.chain
    axes = [axis.name for axis in chain.axes]
    yield f"{chain.name}: what the position of the tool tip tells\n"
    yield f"\nwith {', '.join(axes)} varied: {identifiable(derivation).to_text()}"
    for name in vary:
        if any(dimension.name == name for dimension in chain.dimensions):
            yield f"\nwith {name} varied, too: {identifiable(derivation, [*axes, name]).to_text()}"
    rotary = [axis.name for axis in chain.axes if axis.rotary]
    if rotary:
        yield f"\nDifferences of readings at ({', '.join(rotary)}), degrees, everything else standing still\n"
        yield report(protocol(equations(derivation, signs=(-1,))))
