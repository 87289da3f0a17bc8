"""A scikit-learn estimator, so that ``Pipeline``, ``GridSearchCV`` and ``cross_val_score`` work with models of time.

Rows are samples in their order, one sample time apart. A score is that of the free run, not of the next sample: what is
predicted is fed back, and the measured output says nothing but where the run begins.

Example:
    >>> import numpy as np
    >>> from sklearn.model_selection import GridSearchCV, TimeSeriesSplit
    >>> import sysid
    >>> from sysid.sklearn import DynamicRegressor
    >>> u = np.random.default_rng(0).standard_normal((200, 1))
    >>> y = np.zeros(200)
    >>> for k in range(1, 200):
    ...     y[k] = 0.8 * y[k - 1] + u[k - 1, 0]
    >>> grid = {"structure": [sysid.ARX(na=1, nb=1, nk=nk) for nk in (0, 1, 2)]}
    >>> search = GridSearchCV(DynamicRegressor(), grid, cv=TimeSeriesSplit(3)).fit(u, y)
    >>> search.best_params_["structure"].label
    'ARX [1; 1; 1]'
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.api import ARX, SystemFit, data, fit
from sysid.estimation import Training
from sysid.extras import need
from sysid.models import AbstractStructure, History

need("sklearn", "sysid.sklearn")

from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin  # noqa: E402 - after it was looked for
from sklearn.metrics import r2_score  # noqa: E402 - as above
from sklearn.utils.validation import check_is_fitted, validate_data  # noqa: E402 - as above

EXPECTED_FAILED_CHECKS = {
    "check_methods_sample_order_invariance": "rows are samples in time: their order is the record",
    "check_methods_subset_invariance": "a free run over part of a record begins anew",
    "check_regressor_multioutput": "100 inputs for 42 samples determine no dynamics; refused in our words",
    "check_fit2d_1sample": "one sample says nothing of a system in time; it is refused in our own words",
}
"""Checks of ``sklearn.utils.estimator_checks`` that no model of time can pass, and why."""


class DynamicRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]  # scikit-learn ships no types
    """Any structure of the workbench as a scikit-learn regressor.

    Args:
        structure: What is fitted; ``None`` for an ARX model of first order with a dead time of one sample.
        training: How a network is trained.
        sample_time: Seconds between rows.
        initial: Output that stands before the first row of :meth:`predict`, in its unit, one for all outputs; ``None``
            for where the fitted record began.

    Attributes:
        fit_: The fit, with everything that :class:`sysid.Fit` can do.
        n_features_in_: Number of inputs.
    """

    def __init__(
        self,
        structure: AbstractStructure | None = None,
        *,
        training: Training | None = None,
        sample_time: float = 1.0,
        initial: float | None = None,
    ) -> None:
        self.structure = structure
        self.training = training
        self.sample_time = sample_time
        self.initial = initial

    def fit(self, X: ArrayLike, y: ArrayLike) -> DynamicRegressor:
        """Fit the structure to one record.

        Args:
            X: Inputs, shape ``(n_samples, n_inputs)``, in the order of time.
            y: Output, shape ``(n_samples,)`` or ``(n_samples, n_outputs)``.

        Returns:
            Itself.
        """
        inputs, output = validate_data(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64, ensure_min_samples=2
        )
        self.single_ = output.ndim == 1
        traces = data((inputs, output), sample_time=self.sample_time)
        names = traces[traces.names[0]].channel_names
        n = inputs.shape[1]
        structure = self.structure or ARX(na=1, nb=(1,) * n, nk=(1,) * n)
        mapping = f"{'+'.join(names[:n])} -> {'+'.join(names[n:])}"
        self.fit_ = fit(traces, mapping, structure, self.training)
        self.begins_at_ = np.atleast_1d(output[0])
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Free run.

        Args:
            X: Inputs, shape ``(n_samples, n_inputs)``.

        Returns:
            The output, shape ``(n_samples,)`` or ``(n_samples, n_outputs)``.
        """
        check_is_fitted(self)
        inputs = validate_data(self, X, reset=False, dtype=np.float64)
        first = self.begins_at_ if self.initial is None else np.full(len(self.begins_at_), float(self.initial))
        return self._run(inputs, first)

    def score(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> float:
        """Coefficient of determination of the free run, begun at the first measured output.

        Args:
            X: Inputs, shape ``(n_samples, n_inputs)``.
            y: Measured output.
            sample_weight: What each sample counts.

        Returns:
            1 for a perfect free run.
        """
        check_is_fitted(self)
        inputs, output = validate_data(self, X, y, reset=False, multi_output=True, y_numeric=True, dtype=np.float64)
        found = self._run(inputs, np.atleast_1d(output[0]))
        return float(r2_score(output, found, sample_weight=sample_weight))

    def _run(self, inputs: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
        found = self.fit_
        # A history is no question of whether the model remembers its output: one that does not begins at its inputs.
        if isinstance(found, SystemFit):
            starts = zip(found.fits.values(), first.tolist(), strict=True)
            runs = [one.simulate(inputs, initial=History.at_rest(inputs=inputs[0], output=y)) for one, y in starts]
            return np.column_stack(runs)
        several = found.model.structure.several_outputs
        history = History.at_rest(inputs=inputs[0], output=first if several else float(first[0]))
        run = found.simulate(inputs, initial=history).reshape(len(inputs), -1)
        return run[:, 0] if self.single_ else run

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags
