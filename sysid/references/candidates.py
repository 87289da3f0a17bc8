"""New experiments in rounds, where a surrogate is to be taught what it is worst at."""

from __future__ import annotations

from dataclasses import dataclass

from sysid.references.config import ReferenceConfig
from sysid.references.design import Design, drawn
from sysid.references.runs import Case

SEED = 55_001
"""Of the candidates, behind the design's and before the round's: neither the design's runs nor a proof are so drawn."""


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Random experiments drawn as a design draws its own: no two rounds have one in common, and none is the design's.

    Args:
        reference: With whole paths.
        design: As they are drawn.
        count: How many a round has.
    """

    reference: ReferenceConfig
    design: Design
    count: int

    def cases(self, number: int) -> list[Case]:
        """The experiments of a round.

        Args:
            number: Of the round, from 1 on; 0 for those that are held out of all.

        Returns:
            The experiments.
        """
        seed, prefix = (self.design.seed, SEED, number), f"G{number}N" if number else "HLD"
        return drawn(self.reference, self.design, self.count, seed=seed, prefix=prefix)
