"""The whole way from measurements and a machine to a verdict."""

from __future__ import annotations

from collections.abc import Sequence

from ncfix.diagnose import checks, constants, gates, mistakes, outliers
from ncfix.diagnose.background import everything_of
from ncfix.diagnose.catalogue import catalogue, without
from ncfix.diagnose.conclusion import concluded
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.findings import Case, Diagnosis, Finding, Gap
from ncfix.diagnose.groups import gather
from ncfix.diagnose.rivals import rivals
from ncfix.diagnose.selection import Selected, judged, select
from ncfix.diagnose.verdict import AMBIGUOUS, FOUND, NOTHING, UNKNOWN
from ncfix.diagnose.view import view
from ncfix.diagnose.wandering import background
from ncfix.diagnose.weighing import Scale
from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement

__all__ = ["AMBIGUOUS", "FOUND", "NOTHING", "UNKNOWN", "Diagnosis", "Finding", "Gap", "diagnose"]


def diagnose(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = ()) -> Diagnosis:
    """Compare, name, add, and show how far the gap shrank. `refused` are names that must not be used.

    Raises `UsageError` NCF630, NCF637 and NCF650 ... NCF659 where the data cannot carry a diagnosis.
    """
    checks.before(measurements, machine)
    wrong = mistakes.find(measurements, machine, refused)
    if wrong is not None:
        measurements, machine = wrong.measurements, wrong.machine
    else:
        checks.sensible(measurements, machine)
    seen = view(measurements, machine)
    checks.enough(seen)
    candidates, unheard_of = without(catalogue(seen.reach), refused)
    gathered = gather(seen, candidates)
    everything = everything_of(seen, gathered.groups)
    groups = (*gathered.groups, *rivals(seen, gathered.groups))
    relative, outlying = outliers.weighed(seen, everything, groups)
    ground = background(seen, everything, relative, gathered.groups)
    court = Court(ground, groups, len(gathered.groups))
    case, scale = Case(seen, candidates, unheard_of, gathered, outlying, court), Scale(court)
    found = concluded(case, scale, _selected(scale))
    return mistakes.told(found, wrong) if wrong else found


def _selected(scale: Scale) -> Selected:
    """What is there: curves and the like while lacking constants are free, then those, then what holds."""
    freed = constants.freed(scale.court)
    members = select(freed, (*freed.names, *freed.court.rivals))
    return gates.passed(scale, judged(scale, constants.added(scale, members)))
