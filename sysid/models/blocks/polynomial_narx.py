"""Polynomial NARX: products of past samples, the few that matter chosen among all."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb
from typing import Annotated, Any

from sysid.equations.system import written_name
from sysid.errors import ConfigError, shortened
from sysid.models.blocks.curves import number
from sysid.models.channels.mapping import Mapping
from sysid.models.orders.lags import Lags, LagSpec, check_reads, parse_lags, parse_output_lags, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

MOST_CANDIDATES = 200_000
MOST_TERMS = 100

Term = tuple[int, ...]
"""The regressors of a product, by their places; none for the constant."""


@dataclass(frozen=True, kw_only=True)
class PolynomialNARX(AbstractStructure):
    """A polynomial in past samples of inputs and output, of a few terms that are chosen, as SysIdentPy's ``FROLS``.

    The terms are those that forward orthogonal least squares takes first (Billings 2013, chapter 3: error reduction
    ratio); how many of them is what the free run says. Their coefficients are then refined for the free run.

    Args:
        input_delays: For every input the lags, or one set for all: ``2`` for 1 and 2, ``"0:2"``, a list.
        output_delays: Lags of the output; ``[]`` for a polynomial of inputs alone (a Volterra series of finite memory).
        degree: Factors of a term at most.
        terms: Terms at most; fewer where the free run does not gain.

    Raises:
        ConfigError: If a field cannot be used.

    Example:
        >>> PolynomialNARX(input_delays=2, output_delays=2, degree=3).label
        'polynomial NARX 2/2, degree 3, up to 20 terms'
    """

    input_delays: Any = 2
    output_delays: Any = 2
    degree: Annotated[int, IntRange(low=1, high=4)] = 2
    terms: Annotated[int, IntRange(low=2, high=30)] = 20

    kind = "PolynomialNARX"
    learns_curves = True

    def __post_init__(self) -> None:
        given = self.input_delays
        # No lags at all are those of no input: a time series.
        several = isinstance(given, list | tuple) and (
            not given or any(isinstance(one, list | tuple | str) for one in given)
        )
        object.__setattr__(self, "input_delays", tuple(map(_lags, given)) if several else (_lags(given),))
        object.__setattr__(self, "output_delays", parse_output_lags(self.output_delays))
        check_reads(self.input_delays, self.output_delays)
        for name, most in (("degree", 9), ("terms", MOST_TERMS)):
            value = getattr(self, name)
            if not whole(value) or not 1 <= value <= most:
                raise ConfigError(
                    f"not a number of {name}" if name == "terms" else "not a degree",
                    where=name,
                    expected=f"a whole number from 1 to {most}",
                    got=shortened(value),
                    remedy="write for example {kind: PolynomialNARX, degree: 2, terms: 10}",
                )

    @property
    def label(self) -> str:
        """Lags, degree and terms."""
        inputs = "+".join(map(_short, self.input_delays))
        lags = f"NARX {inputs}/{_short(self.output_delays)}" if self.output_delays else f"NFIR {inputs}"
        return f"polynomial {lags}, degree {self.degree}, up to {self.terms} terms"

    def lags(self, n_inputs: int) -> Lags:
        """The regressors."""
        given = self.input_delays * n_inputs if len(self.input_delays) == 1 else self.input_delays
        check_reads(given, self.output_delays)
        return Lags(inputs=given, output=self.output_delays)

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse lags that are not for these inputs, and more candidates than can be looked at."""
        if len(self.input_delays) not in {1, n_inputs}:
            raise ConfigError(
                "the delays do not match the inputs", where="input_delays", expected=f"{n_inputs} sets, or one for all",
                got=len(self.input_delays), remedy="give a set of lags for each input of the mapping",
            )  # fmt: skip
        count = comb(self.lags(n_inputs).n_regressors + self.degree, self.degree)
        if count > MOST_CANDIDATES:
            raise ConfigError(
                "too many candidate terms", where="degree", expected=f"at most {MOST_CANDIDATES:,}", got=f"{count:,}",
                remedy="use fewer lags, or a lower degree",
            )  # fmt: skip

    def candidates(self, n_inputs: int) -> list[Term]:
        """Every product of up to ``degree`` regressors, the constant first."""
        n = self.lags(n_inputs).n_regressors
        return [term for d in range(self.degree + 1) for term in combinations_with_replacement(range(n), d)]

    def regressors(self, mapping: Mapping, origin: Iterable[float] | None = None) -> list[str]:
        """The regressors as equations have them, inputs first.

        Args:
            mapping: Which channels go in, which comes out.
            origin: What each channel is counted from, inputs first; nothing by default.

        Returns:
            Their texts.
        """
        lags = self.lags(len(mapping.inputs))
        names = (*mapping.inputs, mapping.output)
        found = []
        levels = (0.0,) * len(names) if origin is None else origin
        for name, each, at in zip(names, (*lags.inputs, lags.output), levels, strict=True):
            plain = [f"{written_name(name)}[k-{lag}]" if lag else written_name(name) for lag in each]
            found += [f"({one} - {number(float(at))})" if at else one for one in plain]
        return found

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "input_delays": [list(lags) for lags in self.input_delays],
            "output_delays": list(self.output_delays),
            "degree": self.degree,
            "terms": self.terms,
        }


def _lags(spec: LagSpec) -> tuple[int, ...]:
    return parse_lags(spec, first=0, where="input_delays")


def _short(lags: tuple[int, ...]) -> str:
    return str(len(lags)) if lags == tuple(range(1, len(lags) + 1)) else f"[{' '.join(map(str, lags))}]"
