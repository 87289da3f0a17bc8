"""What a fit shows of itself and writes, whether it is of one output or of several."""

from __future__ import annotations

from abc import ABC, abstractmethod
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import datetime
    from pathlib import Path

    from matplotlib.figure import Figure

    from sysid.api.given import TracesLike
    from sysid.export import Bundle
    from sysid.models import Start
    from sysid.reporting.linear.responses import Bode, Poles, StepResponse
    from sysid.traces import TraceSet


class AbstractResponses(ABC):
    """A fit that says what it is, and answers to steps and to sines where it is linear."""

    @abstractmethod
    def summary(self) -> str:
        """What was fitted, as lines of text."""

    def step(self, *, seconds: float | datetime.timedelta | None = None) -> StepResponse:
        """Its step responses with their intervals; see :func:`sysid.step`.

        Args:
            seconds: Length in s, or a duration; by default until the slowest pole has settled.

        Returns:
            The change of each output after a step of one unit in each input, in its unit, and 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or the length is none.
        """
        from sysid.api.responses import step

        return step(self, seconds=seconds)

    def bode(self, *, frequency: Any = None) -> Bode:
        """Its Bode diagram with its intervals; see :func:`sysid.bode`.

        Args:
            frequency: In rad/s, shape ``(n,)``; by default four decades up to the Nyquist frequency.

        Returns:
            Gain, in units of the output per unit of the input, and phase in degrees, with 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or a frequency is none.
        """
        from sysid.api.responses import bode

        return bode(self, frequency=frequency)

    def poles(self) -> Poles:
        """Its poles with their intervals; see :func:`sysid.poles`.

        Returns:
            The poles, the slowest first, with time constants in s and natural frequencies in rad/s.

        Raises:
            ConfigError: If it is not linear.
        """
        from sysid.api.responses import poles

        return poles(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>"


class AbstractFit(AbstractResponses):
    """A fit with the data that it was made of; the models of several outputs answer all at once."""

    if TYPE_CHECKING:  # fields of the dataclasses below

        @property
        def traces(self) -> TraceSet:
            """The data set."""

        @property
        def start(self) -> Start:
            """How each free run begins where nothing else is said."""

    def plot(self, traces: TraceSet | None = None) -> Figure:
        """Its free run over the measured output, case by case.

        Args:
            traces: The cases; all of its data set by default.

        Returns:
            A figure of matplotlib's, to restyle, show or save.
        """
        from sysid.api.comparison import compare

        fit: Any = self
        return compare(self.traces if traces is None else traces, fit, start=self.start).plot()

    def save(
        self, folder: str | Path, traces: TracesLike | None = None, *, formats: tuple[str, ...] | None = None
    ) -> Bundle:
        """Write it as files that run elsewhere, with its figures on the records of the fit; see :func:`sysid.save`.

        Args:
            folder: Where the bundle goes.
            traces: Further records to check the files and to score the model on.
            formats: As for :func:`sysid.save`.

        Returns:
            The bundle.

        Raises:
            ParityError: If a file differs from its model; nothing is published then.
        """
        from sysid.api.saving import save

        fit: Any = self
        return save(fit, self.traces if traces is None else traces, folder, formats=formats, start=self.start)
