"""The YAML of a pipeline that fits a measured frequency response."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field, PlainSerializer, field_validator, model_validator

from sysid.api.measured_responses.orders import FEWEST, MOST
from sysid.api.measured_responses.problem import Weighting
from sysid.errors import ConfigError
from sysid.estimation import TransferFunctionTraining
from sysid.field_checks import FieldError, FolderName
from sysid.ingest import FileOptions
from sysid.models import Domain, Mapping, TransferFunction
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.workbench.fields import (
    SingleMappingField,
    TransferFunctionConfig,
    as_field_error,
    given_options,
    options_config,
)
from sysid.workbench.fits.shared_config import FilesConfig
from sysid.workbench.old_words import STRICT


class ResponseReportConfig(BaseModel):
    """What the report shows.

    Args:
        frequency: Unit of the frequencies that are drawn: ``Hz``, or ``rad/s``.
    """

    model_config = STRICT

    frequency: FrequencyUnit = HERTZ


def _poles(value: object) -> object:
    """A number of poles, or the least and the largest, as numbers or as ``1:6``."""
    words = value.split(":") if isinstance(value, str) else value if isinstance(value, list | tuple) else [value]
    counts = [word for word in (str(one).strip() for one in words) if word.isdecimal() and int(word) > 0]
    if not len(counts) == len(words) <= 2 or list(map(int, counts)) != sorted(map(int, counts)):
        raise FieldError(
            "not a number of poles",
            expected="for example 2, or 1:6 for the best of these",
            got=str(value),
            remedy="write poles: 2 (--poles 2), or leave it out",
        )
    return tuple(map(int, counts))


PolesField = Annotated[
    tuple[int, ...],
    BeforeValidator(_poles, json_schema_input_type=int | str | list[int]),
    PlainSerializer(lambda counts: counts[0] if len(counts) == 1 else ":".join(map(str, counts))),
]


class ResponseConfig(BaseModel):
    """A pipeline that fits a transfer function to a measured frequency response.

    Args:
        kind: ``response``.
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: The file of the response; a path is relative to the folder of the pipeline.
        columns: Which column holds ``frequency``, ``gain``, ``phase``, ``real``, ``imaginary``, ``complex`` or
            ``coherence``, where their names do not say it.
        units: Of ``frequency``, ``gain`` and ``phase``, where the columns do not say them.
        files: How the file is read, as of a data set under ``source``.
        mapping: What input and output are called, such as ``torque -> speed``.
        channel_units: Unit of the input and of the output, by name; ``1`` by default.
        poles: How many, or ``least:largest``, of which the best is taken.
        zeros: How many; one less than poles by default, and in a search as many as are needed.
        dead_time: In seconds, a multiple of ``sample_time``; searched by default.
        sample_time: Of the model in seconds; of a continuous one by default some 20th of the shortest period.
        domain: Of the model: ``continuous`` or ``discrete``.
        weighting: What counts of the error at each frequency: ``none``, ``relative``, ``root`` or ``coherence``.
        training: Options of the fit.
        seed: Of its random starts.
        export: What leaves the workbench; ``null`` for nothing.
        report: What the report shows.
    """

    model_config = STRICT

    kind: Literal["response"]
    name: FolderName
    description: str = ""
    data: str
    columns: dict[str, str] = Field(default_factory=dict)
    units: dict[str, str] = Field(default_factory=dict)
    files: FileOptions | None = None
    mapping: SingleMappingField = Mapping.of("u -> y")
    channel_units: dict[str, str] = Field(default_factory=dict)
    poles: PolesField = (FEWEST, MOST)
    zeros: int | None = Field(default=None, ge=0)
    dead_time: float | None = Field(default=None, ge=0.0, allow_inf_nan=False)
    sample_time: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    domain: Domain = Domain.CONTINUOUS
    weighting: Weighting = Weighting.NONE
    training: TransferFunctionConfig | None = None
    seed: int = Field(default=0, ge=0)
    export: FilesConfig | None = FilesConfig()
    report: ResponseReportConfig = ResponseReportConfig()

    @field_validator("training", mode="wrap")
    @classmethod
    def _of_a_transfer_function(cls, value: object, _: object) -> Any:
        return options_config(TransferFunction(poles=(1,), zeros=(0,), intercept=False), value)

    @field_validator("channel_units")
    @classmethod
    def _of_the_channels(cls, value: dict[str, str], info: Any) -> dict[str, str]:
        mapping: Mapping | None = info.data.get("mapping")  # absent where it is wrong itself, which is told
        strangers = sorted(set(value) - set(mapping.channels if mapping is not None else value))
        if mapping is not None and strangers:
            raise FieldError(
                f"channel_units names {', '.join(strangers)}, which is neither input nor output",
                expected=", ".join(mapping.channels), got=", ".join(strangers),
                remedy="name these; units of the columns are said under units",
            )  # fmt: skip
        return value

    @model_validator(mode="after")
    def _of_one_kind(self) -> ResponseConfig:
        try:
            _ = self.structure
        except ConfigError as error:
            raise as_field_error(error) from error
        if self.domain is Domain.DISCRETE and self.sample_time is None:
            raise FieldError(
                "a discrete model has a sample time", expected="sample_time in seconds", got="none",
                remedy="write for example sample_time: 0.01 (--sample-time 0.01), or fit a continuous one",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _a_multiple(self) -> ResponseConfig:
        if not self.dead_time:
            return self
        part = f"{self.dead_time / 20:g}"
        samples = self.dead_time / self.sample_time if self.sample_time else float("nan")
        if not (samples > 0.0 and abs(samples - round(samples)) < 1e-6 * samples):
            raise FieldError(
                "a dead time is a multiple of the sample time",
                expected="a sample_time (--sample-time) beside it, of which it is a multiple",
                got=f"dead_time {self.dead_time:g}, sample_time {self.sample_time or 'not given'}",
                remedy=f"write for example sample_time: {part} (--sample-time {part})",
            )
        return self

    @property
    def delays(self) -> tuple[int, ...] | None:
        """The dead time in samples, where it was given."""
        if self.dead_time is None:
            return None
        return (0,) if self.sample_time is None else (round(self.dead_time / self.sample_time),)

    @property
    def structure(self) -> TransferFunction:
        """What is fitted; of a range of poles with the most of them."""
        n = self.poles[-1]
        zeros = n - 1 if self.zeros is None else min(self.zeros, n) if self.searched else self.zeros
        return TransferFunction(
            poles=(n,), zeros=(zeros,), delays=self.delays, domain=self.domain, intercept=False
        )  # fmt: skip

    @property
    def searched(self) -> bool:
        """Whether orders are compared."""
        return len(self.poles) > 1

    @property
    def options(self) -> TransferFunctionTraining:
        """The options of the fit, with the pipeline's seed where they name none."""
        given = {"seed": self.seed, **(given_options(self.training) or {})}
        return TransferFunctionTraining(**given)
