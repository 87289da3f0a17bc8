"""results.json of an assembly: figures under documented keys; tables and sentences are made of them elsewhere."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from sysid.reporting.fit_records import AttemptRecord, ExportRecord
from sysid.reporting.records import DataSetRecord, Number, Record, RunResults
from sysid.traces import Role

ByCase = dict[str, Number]
"""A figure by case."""


class AssemblyCase(Record):
    """One scored case."""

    role: Role
    samples: int = Field(ge=1, description="How many it has.")
    duration_s: Number = Field(description="Length in seconds: samples times sample time.")
    run_time_s: Number = Field(
        description="Seconds that a free run of the chosen whole takes, compiled, on one core: median of repeats, warm."
    )


class OutputRecord(Record):
    """One output that is scored."""

    unit: str = Field(description="Its unit.")


class StageRecord(Record):
    """The whole as it stood after one stage of its training; or a whole beside it, or the mean of both."""

    name: str = Field(description="What it is called.")
    networks: list[str] = Field(default=[], description="Its networks, where they are others than a stage before.")
    selection: Number = Field(
        description="Mean squared error on the selection traces: geometric mean over traces and outputs."
    )
    mse: dict[str, ByCase] = Field(
        description="Mean squared error of the free run of the whole by output and case, in the output's unit squared."
    )


class WholeRecord(Record):
    """The chosen whole."""

    stage: str = Field(description="Name of the stage that was chosen: the one with the least selection, or the mean.")
    inputs: list[str] = Field(description="Channels that it reads, and no others.")
    models: int = Field(description="How many models it is made of.")
    parameters: int = Field(description="Of all its models together.")


class PublishedOutput(Record):
    """Published figures of an output, beside ours."""

    source: str = Field(description="Where they are printed.")
    target: Number = Field(default=1.0, description="Share of the published figure that is aimed at.")
    mse: ByCase = Field(description="In the output's unit squared.")


class OneStepFit(Record):
    """The same structure fitted one step ahead."""

    one_step_mse: ByCase = Field(description="One step ahead of measured output, in the unit squared.")
    free_run_mse: ByCase = Field(description="Of the same fit in free run, in the unit squared.")


class CandidateRecord(Record):
    """One fit of a member, by itself behind measured inputs."""

    structure: str = Field(description="Its label, such as NARX 4/4/20.")
    seed: int = Field(description="Of its first start.")
    best_alone: bool = Field(description="Whether it is the best by itself on the selection traces.")
    chosen: bool = Field(description="Whether the whole has it.")
    selection: Number = Field(description="Mean squared error on the selection traces, geometric mean, unit squared.")
    free_run_mse: ByCase = Field(description="In the unit squared.")
    run_time_s: ByCase = Field(description="Seconds of a free run, compiled, on one core: median of repeats, warm.")
    one_step: OneStepFit | None = None


class MemberRecord(Record):
    """A member that had a choice of fits."""

    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    unit: str = Field(description="Unit of its output.")
    candidates: list[CandidateRecord] = Field(min_length=1, description="In the order in which they were fitted.")

    @property
    def cases(self) -> list[str]:
        """The scored cases."""
        return list(self.candidates[0].free_run_mse)


class RoundRecord(Record):
    """One round of training the whole end to end."""

    name: str = Field(description="Such as 2, or 2.1 of active learning.")
    trained: list[str] = Field(description="Outputs of the members that it trained.")
    all_instances: bool = Field(description="Whether it trained them at all the positions that share their weights.")
    measured: list[str] = Field(description="Outputs that were as measured.")
    traces: int = Field(description="How many traces it was fitted to.")
    iterations: int = Field(description="Of the state that was chosen; 0 is where the round began.")
    train_time_s: Number = Field(description="Seconds of the whole round.")
    loss: Number = Field(
        description="Mean squared residual of the chosen state, in the errors that count as one; null at the start."
    )
    selection_before: Number = Field(
        description="Squared error on the selection traces where it began, in those errors: geometric mean."
    )
    selection_after: Number = Field(description="The same of the state that was chosen.")
    status: str = Field(description="Name of the status, such as STOPPED_EARLY.")
    attempts: list[AttemptRecord] = Field(
        default=[], description="Every start at every checkpoint; errors squared, in the errors that count as one."
    )
    notes: list[str] = Field(default=[], description="What the fit says of itself.")


class SequenceErrors(Record):
    """How a whole does on sequences that train nothing."""

    within: Number = Field(description="Share of the sequences whose error is under the limit, 0 to 1.")
    median: Number = Field(description="Root mean square error of the sequence in the middle, in the unit.")
    p99: Number = Field(description="Root mean square error that 99 % of the sequences stay under, in the unit.")


class ActiveLearningRound(Record):
    """One round of active learning."""

    number: int = Field(description="0 is the whole as it was before.")
    stage: str = Field(description="Name of the stage that it ends with.")
    added: list[str] = Field(description="Names of the sequences that were added for it.")
    traces: int = Field(description="Traces that the whole was trained on.")
    samples: int = Field(description="Samples of these.")
    train_time_s: Number = Field(description="Seconds that its training took.")
    held_out: SequenceErrors = Field(description="On sequences of the pool that train nothing.")
    monte_carlo: SequenceErrors | None = Field(
        default=None, description="On the random sequences of the Monte Carlo test, where there are such."
    )
    selection: Number = Field(description="Error by which stages are chosen.")


class ActiveLearningRecord(Record):
    """Training data that were added from a pool, round by round."""

    outputs: list[str] = Field(description="Outputs whose error is looked at; the largest counts.")
    unit: str = Field(default="", description="Their unit; empty where they differ.")
    limit: Number = Field(description="Root mean square error that a sequence should stay under, in the unit.")
    aim: Number = Field(description="Share of the sequences under the limit that ends it, 0 to 1.")
    pick: str = Field(description="Which sequences are added: worst, or next of the pool.")
    held_out: int = Field(description="How many sequences of the pool train nothing.")
    ended: str = Field(description="Why no further round was begun.")
    rounds: list[ActiveLearningRound] = Field(min_length=1)


class AblationComparison(Record):
    """One step of modelling by parts, before and after."""

    what: str = Field(description="A member's mapping, or 'the whole'.")
    before: Number = Field(
        description="Mean squared error of the free run, geometric mean over outputs and counted cases; null: diverges."
    )
    after: Number = Field(description="The same after.")
    one_step: Number = Field(default=math.nan, description="One step ahead before, where that is what deceives.")

    @property
    def better(self) -> bool:
        """Whether it is better after; what diverges is worse than any number."""
        after = self.after if math.isfinite(self.after) else math.inf
        return after < (self.before if math.isfinite(self.before) else math.inf)


class AblationRecord(Record):
    """What one step of modelling by parts brings."""

    step: Literal["close_loop", "choose_together", "retrain", "train_together"] = Field(
        description="close_loop, choose_together, retrain or train_together."
    )
    published: str = Field(default="", description="What was published on it.")
    comparisons: list[AblationComparison] = Field(min_length=1)


class WorstSequence(Record):
    """A random sequence with a large error."""

    name: str = Field(description="Its name.")
    rmse: Number = Field(description="Root mean square error, in the output's unit.")


Quantiles = dict[float, Number]
"""Root mean square error of a sequence by quantile over the sequences."""


class KindRecord(Record):
    """The whole on the random sequences of one kind."""

    sequences: int = Field(description="How many were run.")
    lost: int = Field(description="How many diverged: held by a network's bound, or no number.")
    within: Number = Field(description="Share of them under the limit, 0 to 1.")
    quantiles: Quantiles = Field(description="By quantile (0 to 1), the error in the unit.")


class MonteCarloRecord(Record):
    """The whole on random sequences of the reference."""

    output: str = Field(description="The output that is judged.")
    unit: str = Field(description="Of the output.")
    sequences: int = Field(description="How many were run.")
    lost: int = Field(description="How many diverged: held by a network's bound, or no number.")
    limit: Number = Field(description="Root mean square error that a sequence should stay under, in the unit.")
    within: Number = Field(description="Share of the sequences under the limit, 0 to 1.")
    quantiles: Quantiles = Field(description="By quantile (0 to 1), the error in the unit.")
    worst: list[WorstSequence] = Field(description="Worst first; their signals are stored.")
    by_state: dict[str, Quantiles] = Field(
        default={}, description="The same over the samples of a state, where an annotator says in which each is."
    )
    by_kind: dict[str, KindRecord] = Field(
        default={}, description="The figures of each kind of sequence, by their names; empty where all are of one."
    )


class ActivityRecord(Record):
    """For how many samples an output was held."""

    low: int = Field(description="Samples at the lower limit.")
    high: int = Field(description="Samples at the upper limit.")
    lost: int = Field(description="At the bound of the network itself.")
    samples: int = Field(ge=1, description="Samples of all runs.")


class LimitRecord(Record):
    """The declared limits of an output, and how often they hold it in free run."""

    output: str = Field(description="What is held.")
    unit: str = Field(description="Of the output.")
    low: float | str | None = Field(description="A value, a channel, or null without one.")
    high: float | str | None = Field(description="A value, a channel, or null without one.")
    cases: ActivityRecord
    sequences: ActivityRecord | None = Field(default=None, description="Over the random sequences.")


class EquationRecord(Record):
    """A submodel that is declared and not fitted."""

    output: str = Field(description="What it gives.")
    unit: str = Field(description="Of the output.")
    equation: str = Field(description="As fixed takes it, such as RL = relay(BP - AR, on=1.45, off=-0.985, slope=20).")
    instances: list[str] = Field(default=[""], description="What follows its channels' names at each of its places.")
    parameters: dict[str, float] = Field(default={}, description="What was estimated in it, each in its unit.")


class LimitExcess(Record):
    """A limit that is a channel, and by how much training traces pass it."""

    output: str = Field(description="What is held.")
    limit: str = Field(description="The channel.")
    unit: str = Field(description="Of the output.")
    most: Number = Field(description="Largest excess of a sample, in the unit; 0 where none passes it.")
    summed: Number = Field(description="Largest sum of a trace's excesses, in the unit.")
    trace: str = Field(description="Name of that trace.")


class LimitCheckRecord(Record):
    """Limits that are channels beside the traces that were trained on."""

    traces: int = Field(description="How many training traces were looked at.")
    limits: list[LimitExcess]

    @property
    def passed(self) -> list[LimitExcess]:
        """Those that some trace passes, the furthest first."""
        return sorted((one for one in self.limits if one.most > 0.0), key=lambda one: -one.summed)


class PositionErrors(Record):
    """One output at its positions."""

    positions: list[float] = Field(description="Increasing.")
    fitted: list[bool] = Field(description="Whether the position is one of the modelled ones.")
    mse: dict[str, list[Number]] = Field(description="By case, at each position, in the output's unit squared.")


class InterpolationRecord(Record):
    """The whole at positions between those that are modelled."""

    outputs: dict[str, PositionErrors]
    run_time_s: ByCase = Field(description="Wall seconds of one run of all positions together on two threads.")


class DoubtShares(Record):
    """What the flag IN_DOUBT is worth on some data."""

    data: str = Field(description="Name of the data set.")
    samples: int = Field(description="How many were looked at.")
    wrong: Number = Field(description="Share of them with an error over what is allowed, 0 to 1.")
    flagged: Number = Field(description="Share of the wrong ones that are in doubt; 1 where none is wrong.")
    false: Number = Field(description="Share of the others that are in doubt.")


class DoubtRecord(Record):
    """What is exported says where it does not know, by the flag IN_DOUBT."""

    output: str = Field(description="The output that is judged.")
    unit: str = Field(description="Of the output.")
    error: Number = Field(description="Largest error of a right answer, in the unit.")
    threshold: Number = Field(description="From here on an answer is in doubt, in the unit.")
    of: Literal["difference", "spread"] = Field(
        description="Of what the threshold is: from the others' answers, or between all that are averaged."
    )
    sentence: str = Field(description="The same in words, as the model card has it.")
    on: list[DoubtShares] = Field(min_length=1, description="First where the threshold was found.")


class AssemblyResults(RunResults):
    """All of results.json of a run of kind assembly."""

    kind: Literal["assembly"] = Field(default="assembly", description="Kind of the pipeline.")
    data: DataSetRecord
    cases: dict[str, AssemblyCase] = Field(min_length=1)
    outputs: dict[str, OutputRecord] = Field(min_length=1)
    whole: WholeRecord
    stages: list[StageRecord] = Field(min_length=1, description="In the order of the training.")
    mean: list[str] = Field(default=[], description="Names of the stages whose mean answers; empty without one.")
    published: dict[str, PublishedOutput] = Field(default={}, description="By output.")
    published_models: str | None = Field(default=None, description="Reference table with models of single members.")
    published_whole: str | None = Field(default=None, description="What that table calls the whole.")
    members: list[MemberRecord] = Field(default=[], description="Those with several candidates.")
    rounds: list[RoundRecord] = Field(default=[])
    active_learning: list[ActiveLearningRecord] = Field(default=[])
    ablation: list[AblationRecord] = Field(default=[], description="The steps that the stages put to the test.")
    monte_carlo: MonteCarloRecord | None = None
    equations: list[EquationRecord] = Field(default=[], description="What is known of the plant, and fixed.")
    limits: list[LimitRecord] = Field(default=[])
    limit_check: LimitCheckRecord | None = None
    interpolation: InterpolationRecord | None = None
    doubt: DoubtRecord | None = None
    exports: list[ExportRecord] = Field(default=[])
    notes: list[str] = Field(default=[], description="Sentences on how the stages came about.")

    @property
    def chosen(self) -> StageRecord:
        """The stage that was chosen."""
        return next(stage for stage in self.stages if stage.name == self.whole.stage)

    def metrics(self) -> dict[str, dict[str, float]]:
        """Numbers to track with each stage: its selection error, and its errors by output and case."""
        found = {
            stage.name: {"selection": stage.selection}
            | {f"{output}/{case}/mse": mse for output, by in stage.mse.items() for case, mse in by.items()}
            for stage in self.stages
        }
        for output, one in ({} if self.interpolation is None else self.interpolation.outputs).items():
            for case, errors in one.mse.items():
                own = [mse for mse, fitted in zip(errors, one.fitted, strict=True) if not fitted]
                if own:
                    found[self.whole.stage] |= {
                        f"{output}/{case}/unseen positions/mse": sum(own) / len(own),
                        f"{output}/{case}/unseen positions/worst mse": max(own),
                    }
        if (doubt := self.doubt) is not None:
            for each in doubt.on:
                shares = {"wrong": each.wrong, "in doubt": each.flagged, "false doubt": each.false}
                found[self.whole.stage] |= {f"{doubt.output}/{each.data}/{name}": v for name, v in shares.items()}
        return found
