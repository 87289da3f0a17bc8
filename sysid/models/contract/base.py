"""What every model can do."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping as Dict
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.models.channels.ends import Ends, check_record
from sysid.models.channels.history import History, input_columns
from sysid.models.channels.mapping import Mapping
from sysid.models.contract.form import AbstractForm
from sysid.models.contract.ratio import Ratio
from sysid.models.orders.structure import AbstractStructure
from sysid.traces import Trace

if TYPE_CHECKING:
    from sysid.models.lagged.cascade_program import Limit


class AbstractModel(ABC):
    """Structure, parameters, scaling and rest value: everything a free run needs.

    Concrete models are frozen dataclasses with at least these fields. Of a model of several outputs
    (:class:`SeveralOutputs`) the output is an array with one column an output wherever it is ``(n_samples,)`` below.
    """

    mapping: Mapping
    """Which channels go in, which come out."""
    sample_time: float
    """Seconds between samples."""
    input_units: tuple[str, ...]
    """Unit of each input."""
    output_unit: str
    """Unit of the output."""
    rest_output: float
    """Output of the system at rest, in its unit: where a free run starts unless told otherwise."""

    structure_field: ClassVar[str] = "network"
    """Name of the field with its structure."""

    @property
    @abstractmethod
    def structure(self) -> AbstractStructure:
        """What was chosen before the fit."""

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """Number of fitted parameters."""

    @property
    def n_together(self) -> int:
        """Parameters that were fitted together: all of them, but for the members of an ensemble."""
        return self.n_parameters

    @property
    def label(self) -> str:
        """What it is called in tables: its structure, and what that does not tell."""
        return self.structure.label

    @property
    @abstractmethod
    def recursion(self) -> AbstractForm:
        """The form that is run and exported."""

    @property
    def pole_radius(self) -> float | None:
        """Magnitude of the largest pole from sample to sample; ``None`` for a model that is not linear."""
        return None

    def ratio(self, j: int) -> Ratio | None:
        """What a linear model is from one input to the output.

        Args:
            j: Which input.

        Returns:
            A ratio of polynomials; ``None`` for a model that is not linear.
        """
        del j
        return None

    @property
    def ratios(self) -> dict[tuple[int, int], Ratio]:
        """What a linear model is from each input to each output, by the places of output and input."""
        found = {(0, j): self.ratio(j) for j in range(len(self.mapping.inputs))}
        return {places: ratio for places, ratio in found.items() if ratio is not None}

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the model again, as JSON values."""
        return {
            "structure": self.structure.to_dict(),
            "mapping": str(self.mapping),
            "sample_time": self.sample_time,
            "input_units": list(self.input_units),
            **self._written_outputs(),
            **self._written(),
        }

    @classmethod
    def from_dict(cls, fields: Dict[str, Any], structure: AbstractStructure) -> Self:
        """The model that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.
            structure: The structure among it, read.

        Returns:
            The model, equal in every parameter.
        """
        make: Any = cls  # a dataclass with these fields
        return make(  # type: ignore[no-any-return]
            **{cls.structure_field: structure},
            mapping=Mapping.parse(fields["mapping"]),
            sample_time=fields["sample_time"],
            input_units=tuple(fields["input_units"]),
            **cls._read_outputs(fields),
            **cls._read(fields),
        )

    @abstractmethod
    def _written(self) -> dict[str, Any]:
        """What a model of this kind has beside structure, channels and units, as JSON values."""

    @staticmethod
    @abstractmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        """Its fields from what :meth:`_written` wrote."""

    def _written_outputs(self) -> dict[str, Any]:
        """Unit of the output, and its value at rest."""
        return {"output_unit": self.output_unit, "rest_output": self.rest_output}

    @staticmethod
    def _read_outputs(fields: Dict[str, Any]) -> dict[str, Any]:
        return {name: fields[name] for name in ("output_unit", "rest_output")}

    @property
    def resting(self) -> float | NDArray[np.float64]:
        """The output at rest, as a history has it."""
        return self.rest_output

    @property
    def ends(self) -> Ends:
        """Its channels, as wiring sees them."""
        return Ends(
            inputs=self.mapping.inputs,
            outputs=self.mapping.outputs,
            input_units=self.input_units,
            output_units=(self.output_unit,),
            rest_outputs=(self.rest_output,),
            direct=self.recursion.reads_now(self.mapping.inputs),
        )

    @property
    def single(self) -> AbstractModel:
        """Itself: where a cascade may stand too, what can be asked of a model alone is asked of this."""
        return self

    @property
    def models(self) -> tuple[AbstractModel, ...]:
        """Itself, as the members of a cascade."""
        return (self,)

    @property
    def variants(self) -> tuple[AbstractModel, ...]:
        """What runs without a record that is known: itself, or one for each case where parameters differ by case."""
        return (self,)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Channels that go in."""
        return self.mapping.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that come out."""
        return self.mapping.outputs

    @property
    def rest(self) -> Dict[str, float | str]:
        """Levels at rest that are declared beside the model's own, as a cascade has them: none."""
        return {}

    @property
    def limits(self) -> Dict[str, Limit]:
        """Limits of its outputs, as a cascade has them: none."""
        return {}

    def run_from(self, inputs: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
        """Free run from rest at some outputs, as of a cascade.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            rest: Each output before the first sample, in its unit, shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_samples, n_outputs)``, in their units.
        """
        resting = rest if self.structure.several_outputs else float(rest[0])
        return self.simulate(inputs, History.at_rest(inputs=inputs[0], output=resting)).reshape(len(inputs), -1)

    def measured(self, trace: Trace) -> NDArray[np.float64]:
        """What a trace has of its outputs.

        Args:
            trace: The trace.

        Returns:
            Shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` for a model of several outputs.

        Raises:
            ChannelError: If it lacks one.
            ConfigError: If it has another sample time than the model, or a channel in another unit.
        """
        check_record(self.ends.units, self.sample_time, trace)
        return trace.columns([self.mapping.output])[:, 0]

    @property
    def vector(self) -> NDArray[np.float64] | None:
        """Flat parameters, as :meth:`with_theta` takes them; ``None`` for a model that has none."""
        return getattr(self.recursion, "theta", None)

    def innovation_responses(self, steps: int) -> NDArray[np.float64] | None:
        """What an innovation does to the outputs over some steps, in their units.

        Args:
            steps: How many, the first is the innovation's own sample.

        Returns:
            Shape ``(steps, n_outputs, n_outputs)``; ``None`` for a model that is not linear, or has none of its noise.
        """
        del steps
        return None

    def over(self, mapping: Mapping) -> Self:
        """The same model over other channels.

        Args:
            mapping: As many inputs and outputs, in the same order.

        Returns:
            The model.
        """
        return dataclasses.replace(self, mapping=mapping)  # type: ignore[type-var]  # every model is a dataclass

    def with_theta(self, theta: NDArray[np.float64]) -> AbstractModel | None:
        """The same model with other parameters.

        Args:
            theta: Flat parameters, as :attr:`vector` has them.

        Returns:
            The model; ``None`` for one that has no flat parameters.
        """
        del theta
        return None

    def output_moves(
        self,
        factor: NDArray[np.float64],
        inputs: NDArray[np.float64],
        history: History,
        measured: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64] | None:
        """How the output moves with the parameters, where that is not the compiled recursion's to say.

        Args:
            factor: Directions of the parameters that a fit is uncertain of, shape ``(n_parameters, n_directions)``.
            inputs: Shape ``(n_samples, n_inputs)``.
            history: The samples before.
            measured: Output from which it is predicted one step ahead, of its shape; ``None`` for the free run.

        Returns:
            Derivatives along each direction, shape ``(n_samples, n_directions)``, or ``(n_samples, n_outputs,
            n_directions)`` of a model of several outputs; ``None`` for a recursion over lags.
        """
        del factor, inputs, history, measured
        return None

    def predict_outputs(
        self, signals: Dict[str, NDArray[np.float64]], rest: Dict[str, float]
    ) -> dict[str, NDArray[np.float64]]:
        """Prediction one step ahead from measured channels, by name: what a model of several outputs has, too.

        Args:
            signals: Every input and output, in its unit, shape ``(n_samples,)`` each.
            rest: Their values before the first sample.

        Returns:
            Every output, shape ``(n_samples,)``; NaN for a model that predicts nothing.
        """
        names, outputs = self.mapping.inputs, self.mapping.outputs
        columns = [signals[name] for name in outputs]
        if not self.recursion.predicts:
            return {name: np.full(len(columns[0]), np.nan) for name in outputs}
        several = self.structure.several_outputs
        resting = np.array([rest[name] for name in outputs]) if several else rest[outputs[0]]
        history = History.at_rest(inputs=[rest[name] for name in names], output=resting)
        inputs = np.array([signals[name] for name in names]).reshape(len(names), -1).T
        found = self.predict(inputs, np.column_stack(columns) if several else columns[0], history)
        return dict(zip(outputs, found.reshape(len(found), -1).T, strict=True))

    def simulate(self, inputs: NDArray[np.float64], history: History | None = None) -> NDArray[np.float64]:
        """Free run: the model is fed its own past output.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the mapping's order and units; one input may lie flat,
                ``(n_samples,)``. What is infinite or masked is read as not a number: the output is not a number for as
                long as it is remembered.
            history: Samples before the first; by default at rest: inputs held at their first sample, output
                at ``rest_output``.

        Returns:
            Output of shape ``(n_samples,)``, in its unit.

        Raises:
            TraceError: If the inputs are no numbers, or not as many as the mapping's.
        """
        inputs = input_columns(inputs, self.mapping.inputs)
        return self.recursion.simulate(inputs, history or self._rest(inputs))

    def forecast(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """What is to be expected after measured samples: the free run, with what is known of the noise carried on.

        Args:
            inputs: As for :meth:`simulate`.
            history: The samples before the first.

        Returns:
            As :meth:`simulate`; its sample ``k`` is what :meth:`predict` says ``k`` steps ahead of the last measured.

        Raises:
            TraceError: If the inputs are no numbers, or not as many as the mapping's.
        """
        return self.recursion.forecast(input_columns(inputs, self.mapping.inputs), history)

    def predict(
        self,
        inputs: NDArray[np.float64],
        output: NDArray[np.float64],
        history: History | None = None,
        *,
        steps: int = 1,
    ) -> NDArray[np.float64]:
        """Prediction ``steps`` ahead from measured output; one step ahead is the open loop.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the mapping's order and units.
            output: Measured output, shape ``(n_samples,)``.
            history: Samples before the first; by default at rest.
            steps: How far ahead.

        Returns:
            Predicted output of shape ``(n_samples,)``, in its unit.

        Raises:
            ConfigError: If the model has no prediction from measured output: its noise is added to the output.
            TraceError: If the number of inputs is not the mapping's.
        """
        if not isinstance(steps, int | np.integer) or steps < 1:
            raise ConfigError(
                "a prediction looks whole samples ahead",
                where="steps",
                expected="a whole number of at least 1",
                got=repr(steps),
                remedy="1 is the next sample; simulate() is the free run, which starts from no measured output",
            )
        inputs = input_columns(inputs, self.mapping.inputs)
        return self.recursion.predict(inputs, output, history or self._rest(inputs), steps)

    def _rest(self, inputs: NDArray[np.float64]) -> History:
        if not len(inputs):
            raise TraceError(
                "there are no samples",
                expected=f"at least one sample of {', '.join(self.mapping.inputs)}, at which the system rests before",
                got=f"inputs of shape {inputs.shape}",
                remedy="give inputs, or the samples before as a history",
            )
        return History.at_rest(inputs=inputs[0], output=self.resting)
