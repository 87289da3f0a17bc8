"""The check of a fit's free run over random sequences, as a pipeline asks for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from pydantic import BaseModel, Field

from sysid.errors import TraceError
from sysid.estimation import FitResult, Loop, Status
from sysid.models import AbstractModel, Mapping
from sysid.traces import Trace
from sysid.validation import AbstractSequences, Excursions, Stability, TraceSequences, check_stability
from sysid.validation.stability import SEED, SEQUENCES, TOLERANCE
from sysid.workbench.fields import STRICT

STILL_S = 20.0
"""Seconds for which a declared sequence's output has to stand still before it is judged."""


class StabilityConfig(BaseModel):
    """Over which sequences a network's free run has to stay bounded and to settle.

    Args:
        sequences: Data set whose traces are run, as they are, such as the random commands of a generator; by default
            excursions made from the estimation traces.
        count: How many at most; 0 checks nothing.
        tolerance: How far from its plateau a run may settle, as a share of the output's range.
        seed: Seed of the sequences.
        choose: Whether the best start gives way to the best stable one. It never does in a fit of the open loop, which
            is not made to run free.
    """

    model_config = STRICT

    sequences: str | None = None
    count: int = Field(default=SEQUENCES, ge=0)
    tolerance: float = Field(default=TOLERANCE, gt=0.0)
    seed: int = Field(default=SEED, ge=0)
    choose: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class StabilityCheck:
    """Checks the candidates of one fit, each once.

    Args:
        config: What is asked.
        sequences: Where the sequences come from; ``None`` checks nothing.
    """

    config: StabilityConfig
    sequences: AbstractSequences | None
    found: dict[int, tuple[AbstractModel, Stability]] = field(default_factory=dict)
    """What was found, by the model's identity; the model is kept so that no other takes its place."""

    @classmethod
    def of(
        cls, config: StabilityConfig, mapping: Mapping, estimation: Sequence[Trace], declared: Sequence[Trace]
    ) -> StabilityCheck:
        """The check of a pipeline.

        Args:
            config: What is asked.
            mapping: Inputs and output.
            estimation: The estimation traces.
            declared: The traces of the data set that is declared, if one is.

        Returns:
            The check.
        """
        inputs, outputs = mapping.inputs, (mapping.output,)
        if config.count == 0:
            return cls(config=config, sequences=None)
        if not declared:
            try:
                return cls(config=config, sequences=Excursions.of(estimation, inputs, outputs))
            except TraceError:  # too short to make sequences from, which is no reason not to fit
                return cls(config=config, sequences=None)
        sequences = TraceSequences(
            inputs=inputs,
            outputs=outputs,
            sample_time=declared[0].sample_time,
            traces=declared,
            source_text=f"The traces of the data set {config.sequences}.",
            still=max(1, round(STILL_S / declared[0].sample_time)),
        )
        return cls(config=config, sequences=sequences)

    def vet(self, loop: Loop) -> Callable[[AbstractModel], bool] | None:
        """What a fit asks of its candidates; ``None`` where it takes the best as it is.

        Args:
            loop: In which loop it is trained.
        """
        return self.passes if self.config.choose and loop is Loop.CLOSED else None

    def passes(self, model: AbstractModel) -> bool:
        """Whether a model's free run is stable.

        Args:
            model: The model.

        Returns:
            The verdict; true where nothing is asked.
        """
        found = self._of(model)
        return found is None or found.stable

    def applied(self, fit: FitResult) -> FitResult:
        """A fit with what the check found of its model.

        Args:
            fit: The fit.

        Returns:
            The fit; its status says so where the free run is unstable.
        """
        found = self._of(fit.model)
        if found is None:
            return fit
        status = fit.status if found.stable or fit.status is Status.INTERRUPTED else Status.UNSTABLE
        return replace(fit, status=status, stability=found.to_dict(), notes=(*fit.notes, found.sentence))

    def _of(self, model: AbstractModel) -> Stability | None:
        if self.sequences is None:
            return None
        if id(model) not in self.found:
            options = {"count": self.config.count, "seed": self.config.seed}
            found = check_stability(model, self.sequences, tolerance=self.config.tolerance, **options)
            self.found[id(model)] = (model, found)
        return self.found[id(model)][1]
