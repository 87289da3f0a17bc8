"""What an estimate of the impulse response is: values with their covariance, a step response, a free run, a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.nonparametric.kernels import Hyperparameters, Kernel
from sysid.estimation.nonparametric.prior import DeadTime
from sysid.models import Mapping

if TYPE_CHECKING:
    import pandas as pd

TAIL = 0.04
"""A response has settled where the end of it, in root mean square, is below this part of its peak."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ImpulseResponse:
    """What the output does after a pulse of one sample in each input.

    Args:
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        lags: In samples, shape ``(n_lags,)``.
        values: Output unit per input unit, shape ``(n_inputs, n_lags)``.
        covariance: Of the values, input after input, shape ``(n_inputs * n_lags, n_inputs * n_lags)``; zero for lags
            before a dead time that was given.
        kernel: The prior that was used.
        hyperparameters: Of each input.
        dead_times: Of each input: when it begins to act, and whether it acts at all.
        noise_variance: Of the innovations, in the output's unit squared.
        noise_ar: Coefficients of the autoregression that whitens the noise, ``v(t) + a1 v(t-1) + ... = e(t)``.
        explained: Share of the output's variance that the response explains, at most 1.
        log_evidence: Logarithm of the marginal likelihood.
        effective: Number of parameters that the data determine.
        samples: Rows that took part.
        notes: What a reader has to know.
    """

    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    lags: NDArray[np.int64]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    kernel: Kernel
    hyperparameters: tuple[Hyperparameters, ...]
    dead_times: tuple[DeadTime, ...]
    noise_variance: float
    noise_ar: tuple[float, ...]
    explained: float
    log_evidence: float
    effective: float
    samples: int
    notes: tuple[str, ...] = ()

    @property
    def deviation(self) -> NDArray[np.float64]:
        """Standard deviation of the values, shape ``(n_inputs, n_lags)``."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.values.shape)

    @property
    def time(self) -> NDArray[np.float64]:
        """Seconds after the pulse, shape ``(n_lags,)``."""
        return self.sample_time * self.lags.astype(np.float64)

    @property
    def noise_deviation(self) -> float:
        """Standard deviation of the noise on the output, coloured as it is, in its unit."""
        pulse = np.zeros(2000)
        pulse[0] = 1.0
        return float(
            np.sqrt(self.noise_variance * np.sum(scipy.signal.lfilter([1.0], [1.0, *self.noise_ar], pulse) ** 2))
        )

    def step(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Response to a step of one unit in each input, and its standard deviation, shape ``(n_inputs, n_lags)``."""
        n = len(self.lags)
        blocks = [self._block(j, j) for j in range(len(self.values))]
        variances = [np.diag(np.cumsum(np.cumsum(block, axis=0), axis=1)) for block in blocks]
        deviation = np.sqrt(np.maximum(np.array(variances), 0.0)) if blocks else np.empty((0, n))
        return np.cumsum(self.values, axis=1), deviation

    def settling(self, share: float = 0.05) -> tuple[int, ...]:
        """Samples after which the step response of each input stays near its end.

        Args:
            share: How near, as a part of the step response's span.

        Returns:
            One number an input; the number of lags where it never does.
        """
        found = []
        for response in self.step()[0]:
            near = share * max(float(np.ptp(np.append(response, 0.0))), 1e-300)
            away = np.flatnonzero(np.abs(response - response[-1]) > near)
            found.append(int(self.lags[away[-1]]) + 1 if len(away) else int(self.lags[0]))
        return tuple(found)

    @property
    def settled(self) -> bool:
        """Whether every response has come to its end within the lags."""
        return all(settled(values) for values in self.values)

    def simulate(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Output without noise and level; before the first sample every input stood where it stands then.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``.

        Returns:
            Shape ``(n_samples,)``.
        """
        u = np.asarray(inputs, dtype=np.float64).reshape(-1, len(self.values))
        deepest = int(self.lags[-1])
        held = np.concatenate([np.repeat(u[:1], deepest, axis=0), u])
        response = np.zeros((len(self.values), deepest + 1))
        response[:, self.lags] = self.values
        made = [np.convolve(g, x)[deepest : len(x)] for g, x in zip(response, held.T, strict=True)]
        return np.asarray(np.sum(made, axis=0))

    def to_frame(self) -> pd.DataFrame:
        """A row for each input and lag.

        Returns:
            Columns ``input``, ``lag``, ``time``, ``value``, ``deviation``, ``low``, ``high`` (95 %).
        """
        import pandas as pd

        deviation = self.deviation
        return pd.concat(
            [
                pd.DataFrame(
                    {
                        "input": name,
                        "lag": self.lags,
                        "time": self.time,
                        "value": self.values[j],
                        "deviation": deviation[j],
                        "low": self.values[j] - 1.96 * deviation[j],
                        "high": self.values[j] + 1.96 * deviation[j],
                    }
                )
                for j, name in enumerate(self.mapping.inputs)
            ],
            ignore_index=True,
        )

    def _block(self, i: int, j: int) -> NDArray[np.float64]:
        n = len(self.lags)
        return self.covariance[i * n : (i + 1) * n, j * n : (j + 1) * n]


def settled(g: NDArray[np.float64]) -> bool:
    """Whether a response is near zero over its last tenth."""
    end = g[-max(len(g) // 10, 3) :]
    return bool(np.sqrt(np.mean(end**2)) <= TAIL * np.abs(g).max())
