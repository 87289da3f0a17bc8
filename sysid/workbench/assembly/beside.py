"""Wholes that stand beside the one that a pipeline trains: they doubt it, or the mean of all answers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from sysid.composite import Doubting, TrainedComposite, TrainingData, committee, doubting, whole_score
from sysid.composite.doubt.committee import check_alike
from sysid.errors import BundleError, ConfigError
from sysid.models import Cascade, Interpolation
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.interpolation import interpolation_of
from sysid.workbench.assembly.proof_config import DoubtConfig, InterpolationConfig, MeanConfig
from sysid.workbench.assembly.written import written
from sysid.workbench.runner.store import LINE, digest, strict

if TYPE_CHECKING:
    from sysid.export import Bundle


@dataclass(frozen=True, kw_only=True, eq=False)
class Other:
    """A whole that was trained apart.

    Args:
        name: What it is called: by its pipeline, or by its folder.
        whole: It.
        place: Where it lies, as the YAML has it; nowhere if it was trained in the same run.
    """

    name: str
    whole: Cascade
    place: str

    @classmethod
    def of_bundle(cls, read: Bundle, place: str) -> Other:
        """The whole of a bundle; a plain model is a whole of one.

        Args:
            read: The bundle.
            place: Where it lies, as it is to be told.

        Returns:
            It.
        """
        name = str((read.metadata.get("provenance") or {}).get("pipeline") or read.folder.stem)
        whole = read.model if isinstance(read.model, Cascade) else Cascade(models=(read.model,))
        return cls(name=name, whole=whole, place=place)

    def of(self, outputs: Collection[str]) -> Cascade:
        """What of it computes some outputs; all of it where it lacks one."""
        return self.whole.upstream_of(outputs) if set(outputs) <= set(self.whole.outputs) else self.whole

    @property
    def sentence(self) -> str:
        """Its name, and which one it is."""
        place = f"{self.place}, " if self.place else ""
        return f"{self.name} ({place}{digest(strict(self.whole.to_dict()))[:12]}...)"


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """What is scored.

    Args:
        stages: The whole after each stage of its training, and what else there is, by name.
        selection: Score of each on the selection traces.
        chosen: Which one answers.
        networks: What each is made of, in words.
        averaged: Of which it is the mean, if it is one.
    """

    stages: Mapping[str, Cascade]
    selection: Mapping[str, float]
    chosen: str
    networks: Mapping[str, list[str]]
    averaged: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Beside:
    """Who stands beside a whole, and what for.

    Args:
        doubt: What is to be doubted.
        doubting: Who doubts it.
        mean: What is to be averaged.
        averaged: Over whom, beside the whole itself.
        outputs: Outputs that are asked of the whole, which are averaged.
        interpolation: What is asked between the positions that are modelled.
    """

    doubt: DoubtConfig | None = None
    doubting: tuple[Other, ...] = ()
    mean: MeanConfig | None = None
    averaged: tuple[Other, ...] = ()
    outputs: tuple[str, ...]
    interpolation: InterpolationConfig | None = None

    @classmethod
    def read(
        cls, doubt: DoubtConfig | None, mean: MeanConfig | None, outputs: Collection[str], folder: Path,
        interpolation: InterpolationConfig | None = None,
    ) -> Beside:  # fmt: skip
        """Read the bundles that sections of a YAML name.

        Args:
            doubt: The one.
            mean: The other.
            outputs: Outputs that are asked of the whole.
            folder: Folder of the YAML.
            interpolation: What is asked between the positions that are modelled.

        Returns:
            All of them.

        Raises:
            BundleError: If a bundle is damaged or lacking.
            ConfigError: If it is a line.
            FieldError: If nobody doubts, or a mean is to be doubted otherwise than by its spread.
        """
        if doubt is not None:
            doubt.check_judges(averaged=mean is not None)
        doubting, averaged = (
            tuple(Other.of_bundle(_read(folder / place), place) for place in (section.beside if section else ()))
            for section in (doubt, mean)
        )
        return cls(
            doubt=doubt, doubting=doubting, mean=mean, averaged=averaged, outputs=tuple(outputs),
            interpolation=interpolation,
        )  # fmt: skip

    def and_trained(self, name: str, whole: Cascade) -> Beside:
        """The same, with a whole more that is averaged: one that was trained in the same run.

        Args:
            name: What it is called.
            whole: The whole.

        Returns:
            All of them.
        """
        other = Other(name=name, whole=whole, place="")
        return replace(self, averaged=(*self.averaged, other))

    def check(self, whole: Cascade) -> None:
        """Refuse those that cannot stand beside a whole.

        Args:
            whole: The whole, or one with the same channels that is not trained yet.

        Raises:
            ConfigError: If one of them has other inputs, units or another sample time, lacks an output, has it at
                another level at rest, or has no output at other positions that is asked there.
        """
        doubted = () if self.doubt is None else (self.doubt.output,)
        for section, asked, others in (("doubt", doubted, self.doubting), ("mean", self.outputs, self.averaged)):
            for one in others:
                where = f"{section}, beside: {one.place}"
                check_alike(whole.upstream_of(asked), one.of(asked), asked, where=where)
        if self.doubting:
            committee([whole, *(one.whole for one in self.doubting)], dict.fromkeys(doubted, 1.0))
        self.answering(whole)
        if self.interpolation is not None:
            for one in self.averaged:
                interpolation_of(self.interpolation, one.of(self.outputs), where=f"mean, beside: {one.place}")

    def answering(self, whole: Cascade) -> Cascade:
        """What answers: the mean of all, or the whole as it is where none is asked for.

        Args:
            whole: The whole.

        Returns:
            The mean, with the spreads that leave it.
        """
        if self.mean is None or not self.averaged:
            return whole
        return committee(self._members(whole), mean=self.outputs).upstream_of([*self.outputs, *self.mean.spreads])

    def line(self, asked: InterpolationConfig, whole: Cascade) -> Interpolation:
        """The line of what answers: where that is a mean, each whole stands at a position behind its own channel.

        Args:
            asked: What stands where.
            whole: The whole, not the mean.

        Returns:
            The line.

        Raises:
            ConfigError: If the outputs cannot be had from the channel at a position.
        """
        if self.mean is None or not self.averaged:
            return interpolation_of(asked, whole)
        first, *others = (interpolation_of(asked, one) for one in self._members(whole))
        return replace(first, beside=tuple(others), spread=tuple(n for n in self.mean.spread if n in asked.outputs))

    def _members(self, whole: Cascade) -> list[Cascade]:
        return [whole.upstream_of(self.outputs), *(one.of(self.outputs) for one in self.averaged)]

    def doubts(self, whole: Cascade, asked: DoubtConfig, traces: Sequence[Trace]) -> Doubting:
        """What answers, with its doubts.

        Args:
            whole: The whole, not the mean.
            asked: What is to be doubted.
            traces: Sequences that trained nothing, on which the threshold is found.

        Returns:
            It.
        """
        if self.mean is None:
            return doubting(whole, asked.asked(), traces, beside=[one.whole for one in self.doubting])
        first, *others = self._members(whole)
        found = doubting(first, asked.asked(), traces, beside=others, mean=self.outputs)
        flagged = [name for name, limit in found.whole.limits.items() if limit.doubt]
        return replace(found, whole=found.whole.upstream_of([*self.outputs, *self.mean.spreads, *flagged]))

    def judged(self, trained: TrainedComposite, data: TrainingData, config: AssemblyConfig) -> Judged:
        """What a run scores, and what of it answers.

        Args:
            trained: What was trained.
            data: What it was trained on.
            config: The pipeline.

        Returns:
            The stages of the training; where there is a mean, the other wholes and the mean behind them.
        """
        # What only the training looked at is no part of the surrogate, nor of its run time.
        stages = {stage: whole.upstream_of(config.wanted) for stage, whole in trained.stages.items()}
        networks = written(config.composite, trained.stages)
        if self.mean is None:
            return Judged(stages=stages, selection=trained.selection, chosen=trained.chosen, networks=networks)
        others = {name: one.of(self.outputs) for name, one in zip(self._names, self.averaged, strict=True)}
        name = f"the mean of {1 + len(others)}"
        more = others | {name: self.answering(trained.model)}
        choosing = data.with_fixed(config.composite).choosing
        scores = {stage: whole_score(whole, choosing, config.plan.outputs) for stage, whole in more.items()}
        networks |= {stage: [f"{len(whole.models)} models of {stage}"] for stage, whole in others.items()}
        return Judged(
            stages=stages | more,
            selection={**trained.selection, **scores},
            chosen=name,
            networks=networks | {name: [f"the mean of {', '.join([trained.chosen, *others])}"]},
            averaged=(trained.chosen, *others),
        )

    @property
    def _names(self) -> list[str]:
        """What those that are averaged are called: by their places, where two have one name."""
        names = [one.name for one in self.averaged]
        return [one.place if names.count(one.name) > 1 else one.name for one in self.averaged]

    def sentence(self, first: str = "this one") -> str:
        """What answers, in words; empty for the whole itself.

        Args:
            first: What the whole is called.

        Returns:
            The sentence.
        """
        if self.mean is None:
            return ""
        others = " and of ".join(one.sentence for one in self.averaged)
        return f"The mean of {1 + len(self.averaged)} wholes answers: of {first} and of {others}."


def _read(path: Path) -> Bundle:
    """A bundle; of a line without one it is said why that is none."""
    from sysid.export import read_bundle

    try:
        return read_bundle(path)
    except BundleError:
        line = path if path.name == LINE else path / LINE
        if not line.is_file():
            raise
        raise ConfigError(
            "a line cannot stand beside a whole",
            where=path,
            expected="a whole, which has its outputs where the pipeline scores them",
            got=f"{line.name}: what writes the field, and apart from it what reads it at any one place",
            remedy="name a bundle that the line's pipeline exported, as runs/NAME; sysid publish RUN --bundle keeps it "
            "beside the page. With interpolation the mean of wholes has positions between",
        ) from None
