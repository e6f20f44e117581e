"""All candidates of a machine and a measurement."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ncfix.diagnose.catalogue import linear, location, rotary, thermal, weight
from ncfix.diagnose.catalogue.candidate import Candidate, Reach
from ncfix.plugins import called, handed, registry


def catalogue(reach: Reach) -> tuple[Candidate, ...]:
    """Every effect with a name that this machine may have, those of plugins too.

    A plugin's effect (hook `register_effects`) with a method `candidates(reach)` brings candidates of its own.
    """
    parts = (linear, rotary, weight, thermal, location)
    found = [each for part in parts for each in part.candidates(reach)]
    for name, plugin in registry("effects").items():
        if hasattr(plugin, "candidates"):
            brought = called("effects", name, plugin.candidates, reach, gives=Iterable)
            found += [handed("effects", name, each, Candidate) for each in brought]
    return tuple(found)


def without(candidates: Sequence[Candidate], names: Sequence[str]) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """The candidates but for those named, and the names that none of them has. Case, blank and hyphen do not count."""
    refused = {plain(name): name for name in names}
    kept = tuple(each for each in candidates if plain(each.name) not in refused)
    there = {plain(each.name) for each in candidates}
    return kept, tuple(name for key, name in refused.items() if key not in there)


def plain(name: str) -> str:
    """A name as it is compared."""
    return re.sub(r"[\s_-]+", " ", name).strip().lower()
