"""results.json of a run that fits a measured frequency response."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from sysid.estimation import Status
from sysid.reporting.fit_records import ExportRecord
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.records import DataSetRecord, Number, Record, RunResults


class ResponseDataRecord(DataSetRecord):
    """What was measured."""

    file: str = Field(description="Where it was read.")
    points: int = Field(description="Frequencies.")
    lowest: Number = Field(description="Lowest frequency in rad/s.")
    highest: Number = Field(description="Highest frequency in rad/s.")
    coherence: bool = Field(default=False, description="Whether a coherence was measured, too.")
    notes: list[str] = Field(default=[], description="What was guessed or left out when it was read.")


class CurveRecord(Record):
    """What was measured and what the model answers, point by point."""

    frequency: list[Number] = Field(description="In rad/s, rising.")
    measured_real: list[Number] = Field(description="Real part, output unit over input unit.")
    measured_imaginary: list[Number] = Field(description="Imaginary part.")
    model_real: list[Number] = Field(description="Real part of the model's.")
    model_imaginary: list[Number] = Field(description="Imaginary part of the model's.")
    coherence: list[Number] | None = Field(default=None, description="From 0 to 1, where it was measured.")


class ParameterRecord(Record):
    """A parameter of the transfer function."""

    name: str = Field(description="B(u, k) of the numerator and F(u, k) of the denominator; k the power.")
    value: Number = Field(description="Its estimate.")
    deviation: Number = Field(description="One standard deviation; null where the response leaves it open.")
    low: Number = Field(description="Lower end of its 95 % interval.")
    high: Number = Field(description="Upper end.")


class RootRecord(Record):
    """A pole or a zero."""

    real: Number = Field(description="Real part: in rad/s, of a discrete model in the z plane.")
    imaginary: Number = Field(description="Imaginary part.")


class ResponseOrderRow(Record):
    """A structure that was compared."""

    poles: int = Field(description="How many.")
    zeros: int = Field(description="How many.")
    dead_time: Number = Field(description="In seconds.")
    left_out: Number = Field(
        description="Error at frequencies left out of the fit, per cent of the response, weighted."
    )
    fit: Number = Field(description="How much of the response the model has, in per cent.")
    score: Number = Field(description="Beyond that of the first, in variances of the noise.")


class ResponseOrdersRecord(Record):
    """What a comparison of orders came to."""

    told: str = Field(description="What was taken, and by what.")
    rows: list[ResponseOrderRow] = Field(description="All that were fitted, the best first.")
    failed: list[str] = Field(default=[], description="Which could not be fitted, and why.")


class ResponseFitRecord(Record):
    """The fit of a transfer function to a response."""

    mapping: str = Field(description="Written as in 'u -> y'.")
    slug: str = Field(description="Name of its folder under fits.")
    label: str = Field(description="Structure in a few characters.")
    structure: dict[str, object] = Field(description="All fields of the structure, with its kind.")
    status: str = Field(description="How it ended, such as CONVERGED.")
    units: tuple[str, str] = Field(description="Of the input and of the output.")
    sample_time: Number = Field(description="Of the model in seconds.")
    dead_time: Number = Field(description="In seconds.")
    weighting: str = Field(description="What counted of the errors: none, relative, root or coherence.")
    fit_percent: Number = Field(description="How much of the response it has: 100 is all, 0 as much as the mean.")
    left_out_percent: Number = Field(
        default=math.nan,
        description="Root mean square of the errors at frequencies left out of the fit, each fifth in turn, in per "
        "cent of the response, weighted; null of too few points.",
    )
    furthest_db: Number = Field(description="Where the gain is furthest off, in dB.")
    furthest_degrees: Number = Field(description="Where the phase is furthest off, in degrees.")
    furthest_at: Number = Field(description="Frequency of the first of these in rad/s.")
    n_parameters: int = Field(description="Fitted parameters.")
    train_time_s: Number = Field(description="Wall seconds of the fit.")
    seed: int | None = Field(default=None, description="Of its random starts.")
    parameters: list[ParameterRecord] = Field(default=[], description="Empty where their uncertainty is not known.")
    poles: list[RootRecord] = Field(default=[])
    zeros: list[RootRecord] = Field(default=[])
    notes: list[str] = Field(default=[], description="Sentences worth knowing.")
    warnings: list[str] = Field(default=[], description="Those that say what the response leaves open.")
    orders: ResponseOrdersRecord | None = Field(default=None, description="Where nobody said the orders.")
    curve: CurveRecord
    exports: list[ExportRecord] = Field(default=[])

    @property
    def ended(self) -> str:
        """How the fit ended, as a sentence."""
        return Status[self.status].value


class ResponseResults(RunResults):
    """All of results.json of a run that fits a measured frequency response."""

    kind: Literal["response"] = Field(description="response.")
    data: ResponseDataRecord
    fits: list[ResponseFitRecord] = Field(min_length=1, description="One object a pair of input and output.")
    frequency: FrequencyUnit = Field(default=HERTZ, description="Unit of the frequencies that the page draws.")
