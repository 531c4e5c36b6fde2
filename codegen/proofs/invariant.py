"""Invariant: the largest part of what is proposed of a Program that holds where it has to.

Houdini (Flanagan and Leino 2001): facts between steps hold after `init` and at the end of a step,
facts of a loop where it begins and at the end of each turn, if all of them held before. What does
not is taken out until the rest does.
"""

from __future__ import annotations

from collections.abc import Mapping

from codegen.proofs.fact import between_steps
from codegen.proofs.symbolic import Claim, World
from codegen.proofs.terms import Range


def invariant(world: World, ranges: Mapping[str, Range]) -> frozenset[Claim]:
    """Return what holds; the `world` has made its step then. `ranges` are those of variables
    between two steps, as far as they stay in them.
    """
    facts = list(between_steps(world.program, ranges))
    first = world.after_init()
    facts = [fact for fact in facts if world.holds_at(first, fact)]
    world.step(facts)
    claims = frozenset(duty.claim for duty in world.duties)
    while lost := world.lost(claims):
        claims -= lost
    return claims
