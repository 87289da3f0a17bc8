"""Transfer functions from data over frequency: measured frequency responses, or input and output spectra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.state import Iteration
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.delay_scan import scan_losses
from sysid.estimation.linear.frequency_response.spectral_record import SpectralRecord
from sysid.estimation.linear.frequency_response.spectrum import Spectrum
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.poles import scattered, sections_of, stabilised
from sysid.estimation.linear.sanathanan_koerner import MAX_ITERATIONS, sk_poles
from sysid.estimation.linear.transfer_function.integrators import all_at_one, with_integrators
from sysid.estimation.linear.transfer_function.problem import AbstractProblem
from sysid.estimation.linear.transfer_function.runs import Delays, End, tried
from sysid.estimation.linear.transfer_function.search import solve
from sysid.estimation.linear.transfer_function.training import Terms, TransferFunctionTraining
from sysid.estimation.linear.variable_projection import Sections, SeparableProvider
from sysid.estimation.results.result import FitResult
from sysid.models import Mapping, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.converting.orthonormal_basis import Domain

FAR_BELOW = 0.2
"""Of the lowest frequency, below which a pole is asked about, whether it is that of an integrator."""
BEGUN = "the poles of another fit"
FEW_STEPS = 6
"""Sanathanan-Koerner iterations by which dead times are told apart."""
LONGEST = "is the longest that was tried"
"""What is said of a dead time at the end of the search."""
PERIODS, SCANNED = 50.0, 4
"""Of the highest frequency, up to which dead times are scanned; and scanned dead times in each of these, as many as
tell a turn from none."""


def _ignore(_: Iteration) -> None:
    """The callback of those who do not watch."""


def fit_spectra(
    spectra: Sequence[Spectrum],
    mapping: Mapping,
    orders: TransferFunction,
    training: TransferFunctionTraining | None = None,
    *,
    sample_time: float,
    input_units: tuple[str, ...],
    output_unit: str,
    rest_output: float = 0.0,
    begin: TransferFunctionModel | None = None,
    on_iteration: Callable[[Iteration], None] = _ignore,
) -> FitResult:
    """Fit a transfer function to data over frequency.

    Least squares on the complex output error, from Sanathanan-Koerner iterations. Dead times are multiples of the
    sample time, also for a continuous transfer function.

    Args:
        spectra: Estimation data.
        mapping: Which channels go in, which comes out.
        orders: The structure, without an intercept; dead times that it leaves open are searched.
        training: How to fit.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
        begin: A model of the same orders, whose poles are the only start; drawn and searched ones by default.
        on_iteration: Called after every iteration of the final run.

    Returns:
        The fit; its mean squared error is that of real and imaginary parts.

    Raises:
        ConfigError: If the orders do not fit the inputs.
        TraceError: If the orders do not fit the data, or a frequency is beyond half the rate of a discrete model.
        FitDivergedError: If no start gives a finite model.
    """
    m = len(mapping.inputs)
    began, orders = now(), orders.for_inputs(m)
    if orders.intercept or any(s.inputs.shape[1] != m for s in spectra):
        raise TraceError(
            "the orders do not match the spectra",
            expected=f"orders without an intercept and {m} inputs everywhere, as in {mapping}",
            got=f"spectra of {sorted({s.inputs.shape[1] for s in spectra})} inputs, "
            f"{'an' if orders.intercept else 'no'} intercept",
            remedy="set intercept: false, and give one input column for each input",
        )
    _check_nyquist(spectra, orders, sample_time)
    largest = [max(float(np.abs(s.inputs[:, j]).max()) for s in spectra) or 1.0 for j in range(m)]
    scale = max(float(np.abs(s.output).max()) for s in spectra) or 1.0
    problem = _Problem(
        spectra=tuple(spectra),
        scaling=Scaling(input_offset=(0.0,) * m, input_scale=tuple(largest), output_offset=0.0, output_scale=scale),
        orders=orders,
        training=training or TransferFunctionTraining(),
        terms=Terms(
            mapping=mapping,
            sample_time=sample_time,
            input_units=input_units,
            output_unit=output_unit,
            rest_output=rest_output,
        ),
        begin=None if begin is None else tuple(sections_of(begin.poles(j), orders.domain) for j in range(m)),
    )
    return solve(problem, began, on_iteration, None)


def _check_nyquist(spectra: Sequence[Spectrum], orders: TransferFunction, sample_time: float) -> None:
    """Refuse frequencies at which a discrete model repeats what it does at others."""
    highest, half = max(float(s.frequency.max()) for s in spectra), np.pi / sample_time
    if orders.domain is Domain.DISCRETE and highest > half * (1.0 + 1e-9):
        raise TraceError(
            "a discrete transfer function has no response beyond half of its sampling rate",
            expected=f"frequencies up to {half:.6g} rad/s, as the sample time is {sample_time:g} s",
            got=f"up to {highest:.6g} rad/s",
            remedy=f"leave these out, take a sample time of {np.pi / highest:.3g} s or less, or domain: continuous",
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Problem(AbstractProblem):
    """Records over frequency."""

    spectra: tuple[Spectrum, ...]
    scaling: Scaling
    orders: TransferFunction
    training: TransferFunctionTraining
    terms: Terms
    begin: Sections | None = None

    def provider(
        self,
        delays: Delays,
        *,
        unknown: int | None = None,  # noqa: ARG002 - spectra have no first samples
    ) -> SeparableProvider:
        """The least-squares problem with these dead times; see the base class."""
        return SeparableProvider(
            poles=self.pole_parameters(self._span),
            n_zeros=self.orders.zeros,
            records=tuple(self._record(spectrum, delays) for spectrum in self.spectra),
            constant=False,
        )

    def starts(
        self,
        provider: SeparableProvider,
        *,
        few: bool,
        alone: bool = True,  # noqa: ARG002 - none of them takes long
    ) -> list[PoleStart]:
        """Sanathanan-Koerner iterations from scattered poles, and some of these as they are; see the base class."""
        if self.begin is not None:
            return [PoleStart(name=BEGUN, sections=self.begin)]
        domain, starts = self.orders.domain, []
        for k, first in enumerate(self._scattered_poles(1 if few else 1 + self.training.scattered_starts), start=1):
            found = tuple(self._sk(provider, j, poles) for j, poles in enumerate(first))
            plain = tuple(sections_of(stabilised(poles, domain), domain) for poles in first)
            starts.append(PoleStart(name=f"Sanathanan-Koerner from scattered poles {k}", sections=found))
            if k > 1:
                starts.append(PoleStart(name=f"scattered poles {k}", sections=plain))
        return starts

    @property
    def goes_on(self) -> bool:
        """Whether it begins at another fit; see the base class."""
        return self.begin is not None

    def unbounded(self) -> _Problem:
        """With poles anywhere: what integrates, or is unstable, is measured in a loop; see the base class."""
        return replace(self, training=replace(self.training, stable=False))

    def asked_from(self, end: End) -> float:  # noqa: ARG002 - as well as its frequencies tell it
        """Far below every frequency; see the base class."""
        return float(np.exp(-FAR_BELOW * 2.0 * np.pi / self._span))

    def held_back(self, radius: float, end: End) -> bool:  # noqa: ARG002 - its points are no samples over time
        """As far as a period of the lowest frequency has it; see the base class."""
        return slow_poles.undecided(radius, [round(self._span)])

    def free_starts(self, provider: SeparableProvider) -> list[PoleStart]:
        """Sanathanan-Koerner iterations whose poles stay where they come to; see the base class."""
        if self.begin is not None:
            return [PoleStart(name=BEGUN, sections=self.begin)]
        return [
            PoleStart(
                name=f"free Sanathanan-Koerner from scattered poles {k}",
                sections=tuple(self._sk(provider, j, poles, stable=False) for j, poles in enumerate(first)),
            )
            for k, first in enumerate(self._scattered_poles(1 + self.training.scattered_starts), start=1)
        ]

    def at_one(self, end: End, *, every: bool = False) -> End:
        """With poles at 1 that lie far below every frequency; see the base class."""
        put = all_at_one if every else with_integrators
        return put(end, self.orders.domain, self.terms.sample_time, FAR_BELOW * 2.0 * np.pi / self._span)

    def delay_range(self) -> tuple[int, int]:
        """As far as half a period of the lowest frequency, or many of the highest; see the base class."""
        least, most = super().delay_range()
        if self.training.max_delay is not None:
            return least, most
        return least, max(most, int(min(self._span / 2.0, PERIODS * self._shortest)))

    def at_end(self, end: End) -> tuple[str, ...]:
        """That a dead time is the longest that was tried, where one was searched; see the base class."""
        most = self.delay_range()[1]
        if self.orders.delays is not None or max(end.delays) < most:
            return ()
        return (
            f"The dead time, {most * self.terms.sample_time:.4g} s, {LONGEST}, and may be longer, or stand for poles "
            "that are lacking: allow more (max_delay), or give it.",
        )

    def likely_delays(self, least: int, most: int) -> list[list[int]]:
        """Those with the least loss of a scan, one input after the other; see the base class."""
        m = len(self.orders.poles)
        if m == len(self.spectra) == 1:
            return self._scanned(least, most)
        best, losses = [least] * m, dict[tuple[int, ...], float]()

        def loss(j: int, delay: int) -> float:
            delays = (*best[:j], delay, *best[j + 1 :])
            if delays not in losses:
                provider, (first,) = self.provider(delays), self._scattered_poles(1)
                found = tuple(self._sk(provider, i, poles, iterations=FEW_STEPS) for i, poles in enumerate(first))
                losses[delays] = tried(PoleStart(name="scan", sections=found), delays, provider).loss
            return losses[delays]

        for j in [*range(m)] * min(m, 2):
            step = max(1, round(self._shortest / SCANNED))
            found = min(range(least, most + 1, step), key=lambda delay: loss(j, delay))
            while step > 1:
                low, high, step = max(least, found - step), min(most, found + step), max(1, step // SCANNED)
                found = min(range(low, high + 1, step), key=lambda delay: loss(j, delay))
            best[j] = found
        return [[one, least] for one in best]

    def _scanned(self, least: int, most: int) -> list[list[int]]:
        """The same of one input and one response, all dead times of a step at once."""
        (spectrum,), T = self.spectra, self.terms.sample_time
        record, ((first,),) = self._record(spectrum, (0,)), self._scattered_poles(1)
        real, imaginary = np.split(record.target, 2)

        def best_of(delays: range) -> int:
            turned = np.exp(-1j * T * np.outer(delays, spectrum.frequency))
            losses = scan_losses(
                turned * record.inputs[:, 0], real + 1j * imaginary, record.variable, first, self.orders.zeros[0],
                domain=self.orders.domain, root_weights=np.split(record.root_weights, 2)[0], iterations=FEW_STEPS,
            )  # fmt: skip
            return delays[int(np.argmin(np.where(np.isfinite(losses), losses, np.inf)))]

        step = max(1, round(self._shortest / SCANNED))
        found = best_of(range(least, most + 1, step))
        while step > 1:
            low, high, step = max(least, found - step), min(most, found + step), max(1, step // SCANNED)
            found = best_of(range(low, high + 1, step))
        return [[found, least]]

    def _scattered_poles(self, count: int) -> list[tuple[NDArray[np.complex128], ...]]:
        """Random poles of every input, as often as asked."""
        rng = np.random.default_rng(self.training.seed)
        return [tuple(self._scattered(n, rng) for n in self.orders.poles) for _ in range(count)]

    def _sk(
        self,
        provider: SeparableProvider,
        j: int,
        first: NDArray[np.complex128],
        *,
        stable: bool = True,
        iterations: int = MAX_ITERATIONS,
    ) -> tuple[NDArray[np.float64], ...]:
        """Poles of one input, from the records in which it is the only one, or from all with common poles."""
        records = [record for record in provider.records if isinstance(record, SpectralRecord)]
        alone = [r for r in records if not np.delete(r.inputs, j, axis=1).any() and r.inputs[:, j].any()]
        chosen = alone or list(records)
        inputs = np.concatenate([r.inputs[:, j : j + 1] if alone else r.inputs for r in chosen])
        halves = [np.split(r.target, 2) for r in chosen]
        output = np.concatenate([real + 1j * imaginary for real, imaginary in halves])
        n = len(first)
        zeros = (self.orders.zeros[j],) if alone else tuple(min(z, n - 1) for z in self.orders.zeros)
        poles = sk_poles(
            inputs,
            output,
            np.concatenate([r.variable for r in chosen]),
            first,
            zeros,
            domain=self.orders.domain,
            weights=np.concatenate([np.split(r.root_weights, 2)[0] for r in chosen]),
            stable=stable,
            iterations=iterations,
        )
        return sections_of(poles, self.orders.domain)

    @property
    def _span(self) -> float:
        """Period of the lowest frequency, in samples."""
        lowest = min(float(s.frequency[s.frequency > 0.0].min(initial=np.inf)) for s in self.spectra)
        return 2.0 * np.pi / lowest / self.terms.sample_time if np.isfinite(lowest) else 1.0

    @property
    def _shortest(self) -> float:
        """Period of the highest frequency, in samples."""
        return 2.0 * np.pi / max(float(s.frequency.max()) for s in self.spectra) / self.terms.sample_time

    def _scattered(self, n: int, rng: np.random.Generator) -> NDArray[np.complex128]:
        """Random poles at the frequencies of the data."""
        every = np.concatenate([s.frequency for s in self.spectra])
        every = every[every > 0.0]
        fastest, slowest = float(every.max()), float(every.min())
        unit = 1.0 / fastest if self.orders.domain is Domain.CONTINUOUS else self.terms.sample_time
        span = int(min(max(10.0 / (slowest * unit), 10.0), 1e9))
        return scattered(n, span, unit, rng, self.orders.domain)

    def _record(self, spectrum: Spectrum, delays: Delays) -> SpectralRecord:
        s = 1j * spectrum.frequency
        T = self.terms.sample_time
        discrete = self.orders.domain is Domain.DISCRETE
        dead = np.exp(-s[:, np.newaxis] * T * np.array(delays))
        output = spectrum.output / self.scaling.output_scale
        root = np.sqrt(spectrum.point_weights)
        return SpectralRecord(
            inputs=spectrum.inputs / np.array(self.scaling.input_scale) * dead,
            variable=np.asarray(np.exp(-s * T) if discrete else s, dtype=np.complex128),
            target=np.concatenate([output.real, output.imag]),
            root_weights=np.concatenate([root, root]),
            domain=self.orders.domain,
        )
