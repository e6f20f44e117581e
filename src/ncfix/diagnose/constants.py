"""Constants of the machine that its file lacks: where axes lie, gains. They go before all that is not one.

Every machine has them, and almost any curve or sag looks like one in part. So names of other effects are looked for
with all of them free; which constants are there is asked afterwards, beside what was found.
"""

from __future__ import annotations

from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.selection import select
from ncfix.diagnose.weighing import Members, Scale

FREE_UM = 300.0
"""How far they may be off while they are free."""


def freed(court: Court) -> Scale:
    """A scale on which the lacking constants are as free as those that the file has."""
    return Scale(court, tuple(Member(court.forms[name][0], FREE_UM) for name in court.names if court.constant(name)))


def added(scale: Scale, members: Members) -> dict[str, Member]:
    """The members and the constants that are there.

    Constants are looked for beside what has no name, before other names have taken their part; with those they leave
    only where the data speak against them.
    """
    court = scale.court
    offered = [name for name in court.names if court.constant(name)]
    if not offered:
        return dict(members)
    nameless = {name: member for name, member in members.items() if name in court.rivals}
    found = {**select(scale, offered, nameless), **members}
    for name in offered:
        less = {key: member for key, member in found.items() if key != name}
        if name in found and scale.weight(less) - scale.price(name) > scale.weight(found):
            found = less
    return found
