"""A fit of several outputs as what is fitted, scored, stored and reported: models, and outputs of models."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace

from sysid.models import Mapping
from sysid.workbench.fits.config import FitConfig, PipelineConfig


@dataclass(frozen=True, kw_only=True)
class FitOutput:
    """One output of a fit: what has figures, pictures and a row in tables.

    Args:
        fit: The fit, under a name of this output's own where the mapping has several.
        config: The pipeline, as of this output alone.
    """

    fit: FitConfig
    config: PipelineConfig


@dataclass(frozen=True, kw_only=True)
class FitModel:
    """One model of a fit: what is fitted and stored.

    Args:
        fit: The fit, under a name of this model's own where each output has one.
        config: The pipeline, as of this model's outputs.
        outputs: Its outputs.
    """

    fit: FitConfig
    config: PipelineConfig
    outputs: tuple[FitOutput, ...]


def models_of(fit: FitConfig, config: PipelineConfig) -> tuple[FitModel, ...]:
    """The models of a fit: one, where the structure has several outputs of its own, else one an output.

    Args:
        fit: The fit.
        config: Its pipeline.

    Returns:
        The models; of a mapping of one output the fit under its own name and the pipeline as it is.
    """
    mapping = config.mapping
    fit = fit.model_copy(update={"structure": fit.structure.for_inputs(len(mapping.inputs))})
    if len(mapping.outputs) == 1:
        return (FitModel(fit=fit, config=config, outputs=(FitOutput(fit=fit, config=config),)),)
    outputs = tuple(FitOutput(fit=_named(fit, one.output, config), config=_of(config, one)) for one in mapping.each)
    structure = config.fitted_as(fit)
    if structure.several_outputs:
        fit = fit.model_copy(update={"structure": structure})
        outputs = tuple(replace(one, fit=one.fit.model_copy(update={"structure": structure})) for one in outputs)
        return (FitModel(fit=fit, config=config, outputs=outputs),)
    return tuple(FitModel(fit=one.fit, config=one.config, outputs=(one,)) for one in outputs)


def _output_name(name: str, output: str) -> str:
    """What one output of a fit is called."""
    return f"{name}, {output}"


def _named(fit: FitConfig, output: str, config: PipelineConfig) -> FitConfig:
    """A fit under the name of one of its outputs; it starts from what the initial fit has of the same output."""
    initial: Dict[str, FitConfig] = {one.name: one for one in config.fits}
    begun = None if fit.initial is None else _output_name(initial[fit.initial].name, output)
    return fit.model_copy(update={"name": _output_name(fit.name, output), "initial": begun})


def _of(config: PipelineConfig, mapping: Mapping) -> PipelineConfig:
    rest = {name: value for name, value in config.rest.items() if name in mapping.outputs}
    return config.model_copy(update={"mapping": mapping, "rest": rest})
