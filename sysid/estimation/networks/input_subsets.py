r"""Some starts see only some of the inputs: what an input misleads to, those that lack it do not learn.

An input may explain the estimation record for a reason that holds there alone. The record does not tell which inputs
these are, and the evidence prunes only what explains nothing. Starts that differ in what they see differ where it
matters, in what they make of inputs that they have not met before: an ensemble of them (``ensemble.py``) is right more
often than one of starts that differ in their random weights alone (Ho 1998, "The random subspace method for
constructing decision forests", there for trees).

A start that does without an input is a network of the whole structure whose weights for that input are zero and are not
trained. With :math:`P` from the basis in which it is trained to its plain parameters, and :math:`E` from those to the
whole structure's, its multistart trains :math:`\theta' \mapsto E P \theta'`; everything else is as for any start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.estimation.least_squares.evidence import Prior
from sysid.estimation.networks.initialise import AbstractLayout, Layout
from sysid.estimation.networks.training import FitProgress, Training
from sysid.estimation.networks.warm_start import places
from sysid.models import Mapping


@dataclass(frozen=True, kw_only=True)
class View:
    """What a share of the starts sees.

    Args:
        without: Inputs that it does without.
        first: Number of its first start, from 0 on.
        training: How its starts are trained; their number and first seed are its own.
        starts: Starts of all views together.
    """

    without: tuple[str, ...]
    first: int
    training: Training
    starts: int

    def report(self, on_progress: Callable[[FitProgress], None]) -> Callable[[FitProgress], None]:
        """Whom its multistart tells: progress counted over the starts over all subsets.

        Args:
            on_progress: Whom the fit tells.

        Returns:
            The callback.
        """
        if self.training.n_starts == self.starts:
            return on_progress

        def report(entry: FitProgress) -> None:
            done = self.first + entry.fraction * self.training.n_starts
            on_progress(replace(entry, start=self.first + entry.start, starts=self.starts, fraction=done / self.starts))

        return report


def views(training: Training, mapping: Mapping) -> list[View]:
    """The starts shared out evenly: first those that see everything, then each set that is left out.

    Args:
        training: How to train.
        mapping: Its inputs.

    Returns:
        The views.

    Raises:
        ChannelError: If an input to leave out is none.
        ConfigError: If a view would have no input left, or no start.

    Example:
        >>> training = Training(starts=5, input_subsets=[["u"]])
        >>> [(view.without, view.first, view.training.n_starts) for view in views(training, Mapping.parse("u+w -> y"))]
        [((), 0, 3), (('u',), 3, 2)]
    """
    sets = ((), *training.input_subsets)
    for without in sets:
        strangers = sorted(set(without) - set(mapping.inputs))
        if strangers:
            raise ChannelError(strangers, mapping.inputs, where="input_subsets")
        if without and set(without) == set(mapping.inputs):
            raise ConfigError(
                "nothing is left to see",
                where="input_subsets",
                expected=f"some of {', '.join(mapping.inputs)}, not all of them",
                got=", ".join(without),
                remedy="keep at least one input",
            )
    share, more = divmod(training.n_starts, len(sets))
    found, first = list[View](), 0
    for number, without in enumerate(sets):
        starts = share + (number < more)
        seconds = training.max_time_s * starts / training.n_starts
        own = replace(training, starts=starts, seed=training.seed + first, max_time_s=seconds, input_subsets=())
        found.append(View(without=without, first=first, training=own, starts=training.n_starts))
        first += starts
    return found


@dataclass(frozen=True, kw_only=True)
class PartLayout(AbstractLayout):
    """Where the parameters of a start stand that does without some inputs.

    Args:
        part: Those that it trains.
        whole: Those of the model.
    """

    part: Layout
    whole: Layout

    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the model's parameters to; see the base class."""
        return self.whole.centre()

    def prior(self, centre: NDArray[np.float64], *, alpha: float, beta: float) -> Prior:
        """The prior over what is trained; see the base class."""
        return self.part.prior(centre, alpha=alpha, beta=beta)

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start of what is trained; see the base class."""
        return self.part.draw(rng, centre)


def part_of(whole: Layout, mapping: Mapping, without: tuple[str, ...]) -> Layout:
    """The layout of the network over the inputs that are left.

    Args:
        whole: The layout over all inputs.
        mapping: Names of the inputs.
        without: Inputs that are left out.

    Returns:
        The layout.
    """
    inputs = tuple(() if name in without else lags for name, lags in zip(mapping.inputs, whole.inputs, strict=True))
    return replace(whole, inputs=inputs)


def embedding(part: Layout, whole: Layout) -> NDArray[np.float64]:
    """``E``: from the parameters of a network over some regressors to those of the same network over all.

    Args:
        part: The layout over some regressors.
        whole: The layout over all, with as many neurons.

    Returns:
        Zeros and ones, shape ``(n_whole, n_part)``.
    """
    k, m, kept = part.neurons, len(part.outputs), np.array(places(whole.columns, part.columns), dtype=np.int64)
    rows = (whole.lags.n_regressors * np.arange(k)[:, None] + kept).ravel()
    where = [
        rows,
        whole.lags.n_regressors * k + np.arange(k),
        whole.readout.start + np.arange(m * k),
        whole.affine.start + np.arange(m),
        *([whole.linear_part(j).start + kept for j in range(m)] if part.linear else []),
        whole.gates.start + rows if part.gated else [],
    ]
    E = np.zeros((whole.n_parameters, part.n_parameters))
    E[np.concatenate(where).astype(np.int64), np.arange(part.n_parameters)] = 1.0
    return E
