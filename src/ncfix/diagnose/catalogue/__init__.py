"""The catalogue of physical effects that may be missing from a machine's model."""

from __future__ import annotations

from ncfix.diagnose.catalogue.build import catalogue, without
from ncfix.diagnose.catalogue.candidate import Candidate, Reach

__all__ = ["Candidate", "Reach", "catalogue", "without"]
