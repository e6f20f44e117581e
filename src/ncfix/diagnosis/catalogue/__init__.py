"""The catalogue of physical effects that may be missing from a machine's model."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ncfix.diagnosis.catalogue.candidate import Candidate, MeasuredRange
from ncfix.diagnosis.catalogue.dynamic import dynamic_candidates
from ncfix.diagnosis.catalogue.geometric import linear_candidates, location_candidates, rotary_candidates
from ncfix.diagnosis.catalogue.thermal import thermal_candidates
from ncfix.diagnosis.catalogue.weight import weight_candidates
from ncfix.plugins import called, handed, registry

__all__ = ["Candidate", "MeasuredRange", "catalogue", "plain", "without"]


def catalogue(measured: MeasuredRange) -> tuple[Candidate, ...]:
    """All named effects that this machine may have, including those of plugins.

    A plugin's effect (hook `register_effects`) with a method `candidates(measured)` brings candidates of its own.
    """
    parts = (
        linear_candidates, rotary_candidates, weight_candidates, thermal_candidates, dynamic_candidates,
        location_candidates,
    )  # fmt: skip
    found = [candidate for candidates in parts for candidate in candidates(measured)]
    for name, plugin in registry("effects").items():
        if hasattr(plugin, "candidates"):
            brought = called("effects", name, plugin.candidates, measured, gives=Iterable)
            found += [handed("effects", name, candidate, Candidate) for candidate in brought]
    return tuple(found)


def without(candidates: Sequence[Candidate], names: Sequence[str]) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """The candidates without those in `names`, and the unknown names. Case, blanks, hyphens and _ do not matter."""
    refused = {plain(name): name for name in names}
    kept = tuple(candidate for candidate in candidates if plain(candidate.name) not in refused)
    there = {plain(candidate.name) for candidate in candidates}
    return kept, tuple(name for key, name in refused.items() if key not in there)


def plain(name: str) -> str:
    """A name normalized for comparison: lower case, single blanks for blanks, hyphens and underscores."""
    return re.sub(r"[\s_-]+", " ", name).strip().lower()
