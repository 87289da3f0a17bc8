"""What a model of several outputs has in the place of what one of a single output has."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.ends import Ends, check_record
from sysid.models.contract.base import AbstractModel
from sysid.traces import Trace


class SeveralOutputs(AbstractModel):
    """A model of a structure with several outputs of its own.

    It simulates and predicts arrays of shape ``(n_samples, n_outputs)``, and so does the form that it lowers to; the
    output of its histories has as many columns. Concrete models have the fields ``output_units`` and ``rest_outputs``
    in place of ``output_unit`` and ``rest_output``; :attr:`ends` has both of either kind.
    """

    output_units: tuple[str, ...]
    """Unit of each output."""
    rest_outputs: tuple[float, ...]
    """Each output at rest, in its unit."""

    @property
    def ends(self) -> Ends:
        """Its channels, as wiring sees them."""
        return Ends(
            inputs=self.mapping.inputs,
            outputs=self.mapping.outputs,
            input_units=self.input_units,
            output_units=self.output_units,
            rest_outputs=self.rest_outputs,
            direct=self.recursion.reads_now(self.mapping.inputs),
        )

    def _written_outputs(self) -> dict[str, Any]:
        return {"output_units": list(self.output_units), "rest_outputs": list(self.rest_outputs)}

    @staticmethod
    def _read_outputs(fields: Dict[str, Any]) -> dict[str, Any]:
        return {name: tuple(fields[name]) for name in ("output_units", "rest_outputs")}

    @property
    def output_unit(self) -> str:  # type: ignore[override]  # read only: a model is frozen
        """The units of all outputs in one text, for people."""
        return ", ".join(dict.fromkeys(self.output_units))

    @property
    def rest_output(self) -> float:  # type: ignore[override]
        """Of a model whose mapping has one output; :class:`ConfigError` for several."""
        self.mapping.check_single()
        return self.rest_outputs[0]

    @property
    def resting(self) -> NDArray[np.float64]:
        """The outputs at rest, shape ``(n_outputs,)``."""
        return np.array(self.rest_outputs, dtype=np.float64)

    def measured(self, trace: Trace) -> NDArray[np.float64]:
        """What a trace has of its outputs, shape ``(n_samples, n_outputs)``."""
        check_record(self.ends.units, self.sample_time, trace)
        return trace.columns(self.mapping.outputs)
