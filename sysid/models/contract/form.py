"""What a model lowers to: the form that is run and exported."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models.channels.history import History
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.column_recursion import ColumnRecursion


class AbstractForm(ABC):
    """A recursion in scaled numbers that can be run freely and be fed with measured output.

    Of a model of one output, the output is an array of shape ``(n_samples,)``; of several outputs, everywhere below,
    ``(n_samples, n_outputs)``.
    """

    scaling: Scaling | VectorScaling
    """Between units and scaled numbers."""
    low: float
    """Lower bound of the output in scaled numbers; ``-inf`` for none."""
    high: float
    """Upper bound of the output in scaled numbers; ``inf`` for none."""
    constants: tuple[str, ...] = ()
    """Names of parameters that differ by case, in the order of :attr:`sysid.models.History.constants`."""
    predicts: bool = True
    """Whether there is a prediction from measured output that is not the free run itself."""

    def reads_now(self, inputs: tuple[str, ...]) -> frozenset[str]:
        """Inputs that are read at the sample of the output.

        Args:
            inputs: Their names.

        Returns:
            Some of them. What a state space reads now is not looked for: all, so that it takes no part in a circle.
        """
        return frozenset(inputs)

    @property
    @abstractmethod
    def numbers(self) -> NDArray[np.float64]:
        """Every number of the form, flat."""

    @property
    def columns(self) -> ColumnRecursion | None:
        """What runs in the compiled pass of a cascade; ``None`` for a form that is no function of lagged samples."""
        return None

    @property
    @abstractmethod
    def memory(self) -> int:
        """Samples of a record from which the state after them can be told."""

    def cased(self, history: History, case: str) -> History:
        """The history before a record, with the values of parameters that differ by case.

        Args:
            history: The samples.
            case: Name of the record.

        Returns:
            The history; as it is for a form without such parameters.
        """
        del case
        return history

    def refined(self, history: History) -> History:
        """The history with which the free run that begins at its oldest samples comes closest to its output.

        Args:
            history: Measured samples, oldest first.

        Returns:
            The same history where :meth:`simulate` finds that state itself.
        """
        return history

    @abstractmethod
    def followed(self, history: History) -> NDArray[np.float64]:
        """The free run over a history itself, from the state that is estimated on it.

        Args:
            history: Measured samples, oldest first.

        Returns:
            Output of the shape of the history's, in its unit; as measured where a recursion has lags before its first
            row.
        """

    @abstractmethod
    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run: the model is fed its own past output.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            history: The samples before.

        Returns:
            Output of shape ``(n_samples,)``, in its unit.

        Raises:
            TraceError: If the number of inputs is not the model's.
        """

    @abstractmethod
    def predict(
        self, inputs: NDArray[np.float64], output: NDArray[np.float64], history: History, steps: int
    ) -> NDArray[np.float64]:
        """Prediction ``steps`` ahead: measured output up to ``t - steps``, the model's own after it.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            output: Measured output, shape ``(n_samples,)``.
            history: The samples before.
            steps: How far ahead, at least 1.

        Returns:
            Predicted output of shape ``(n_samples,)``; its first ``steps`` samples start from the history.

        Raises:
            ConfigError: If the form does not predict.
            TraceError: If the number of inputs is not the model's.
        """

    def forecast(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """What is to be expected after measured samples: the free run, with what is known of the noise carried on.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            history: The samples before.

        Returns:
            As :meth:`simulate`, which it is for a form whose noise leaves nothing behind, or stands in its past
            outputs.

        Raises:
            TraceError: If the number of inputs is not the model's.
        """
        return self.simulate(inputs, history)


def unheeded(initial: object, *, model: str) -> ConfigError:
    """Why a run does not begin at an output that was given.

    Args:
        initial: The output.
        model: The model's structure, or mapping.

    Returns:
        The error.
    """
    return ConfigError(
        f"an output before the first sample says nothing to {model}: the run would be the same without it",
        where="initial",
        expected="a model that remembers its own output, or one that may rest at any",
        got=f"initial {initial}",
        remedy="leave it out, or give measured samples of the output, from which the state is found: in Python "
        "several before the run, initial=(u_before, y_before); to sysid simulate the output's column beside the inputs",
    )


def no_prediction(kind: str) -> ConfigError:
    """Why a model with noise on its output alone does not predict.

    Args:
        kind: What kind of model, with its article.

    Returns:
        The error.
    """
    return ConfigError(
        f"{kind} has no prediction from measured output",
        expected="a model that says what measured output tells: ARX, ARMAX, BJ, SS, or NARX",
        got="one whose noise is added to its output, so that measured output says nothing about what follows",
        remedy="use simulate: its free run is what it predicts any number of steps ahead",
    )
