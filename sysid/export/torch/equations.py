"""Equations as torch modules: a step of one stage, and the programs that it runs.

Annotations are evaluated in this file, because TorchScript does not read them as text. TorchScript cannot script a
program that is data, and does not have to: it is traced into straight lines, while the loop over the solver's steps is
scripted.
"""

import warnings

import torch
from torch import Tensor, nn

from sysid.export.forms.programs import INPUT, STATE, Listing, Read
from sysid.export.forms.stage import Stage


class Program(nn.Module):
    """A listing, run on tensors.

    Args:
        listing: The listing.
    """

    def __init__(self, listing: Listing) -> None:
        super().__init__()
        self.listing = listing

    def forward(self, x: Tensor, u: Tensor, like: Tensor) -> Tensor:
        """Run it.

        Args:
            x: States, shape ``(batch, n_states)``.
            u: What the programs read of the inputs, shape ``(batch, n_given)``; slopes read one more, the share.
            like: Anything of shape ``(batch,)``.

        Returns:
            Shape ``(batch, n_results)``.
        """
        columns = {STATE: x, INPUT: u}
        values: list[Tensor] = []

        def read(one: Read) -> Tensor | float:
            if isinstance(one, float):
                return one
            return columns[one.kind].select(1, one.at) if one.kind in columns else values[one.at]

        for one in self.listing.instructions:
            reads = [read(place) for place in one.reads]
            if not any(torch.is_tensor(value) for value in reads):
                reads[0] = torch.full_like(like, float(reads[0]))
            points = (one.points,) if one.points else ()
            values.append(one.operation.torch(torch, *reads, *points))
        results = [read(one) for one in self.listing.results]
        return torch.stack([one if torch.is_tensor(one) else torch.full_like(like, one) for one in results], dim=1)


class EquationStep(nn.Module):
    """One step of a stage that is equations; see :class:`sysid.export.torch.module.LaggedStep`.

    Args:
        stage: The stage.
        limits: What holds its outputs.
    """

    sources: Tensor
    line_columns: Tensor
    given: list[list[tuple[int, float]]]
    stages: list[tuple[float, float, float]]

    def __init__(self, stage: Stage, limits: nn.Module) -> None:
        super().__init__()
        form, layout = stage.equations
        self.given = [
            [
                (form.n_inputs + layout.lines[channel].column(lag) if lag else channel, weight)
                for channel, lag, weight in parts
            ]
            for parts in form.given
        ]
        self.register_buffer("sources", torch.tensor(stage.known_sources, dtype=torch.long))
        self.register_buffer("line_columns", torch.tensor(layout.next_columns(), dtype=torch.long))
        self.slopes, self.updates, self.outputs = (Program(one) for one in form.run.values())
        self.first, self.size, self.n, self.n_continuous = (
            int(stage.first),
            layout.size,
            form.n_state,
            form.n_continuous,
        )
        self.stages = [(share * form.step, ahead, behind) for share, ahead, behind in form.stages]
        self.substeps, self.limited, self.ahead = form.substeps, stage.limited, form.ahead
        self.limits = limits

    def forward(self, known: Tensor, whole_state: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """One step; see :class:`sysid.export.torch.module.LaggedStep`."""
        state = whole_state.narrow(1, self.first, self.size)
        inputs = known.index_select(1, self.sources)
        together = torch.cat([inputs, state], dim=1)
        like = known.select(1, 0)
        columns: list[Tensor] = []
        for parts in self.given:
            total = torch.zeros_like(like)
            for column, weight in parts:
                total = total + together.select(1, column) * weight
            columns.append(total)
        u = torch.stack(columns, dim=1) if len(columns) > 0 else together.narrow(1, 0, 0)
        x = state.narrow(1, 0, self.n)
        # What a state that is no number makes of the rest.
        lost = (x.sum(dim=1, keepdim=True) * 0.0) if self.n > 0 else torch.zeros_like(known.narrow(1, 0, 1))
        parts_after: list[Tensor] = []
        if self.n_continuous > 0:
            now = x.narrow(1, 0, self.n_continuous)
            others = x.narrow(1, self.n_continuous, self.n - self.n_continuous)
            for part in range(self.substeps):
                at, total = now, torch.zeros_like(now)
                for counts, ahead, behind in self.stages:
                    share = torch.full_like(like, (part + behind) / self.substeps).unsqueeze(1)
                    slope = self.slopes(torch.cat([at, others], dim=1), torch.cat([u, share], dim=1), like)
                    total = total + counts * slope
                    at = now + ahead * slope
                now = now + total
            parts_after.append(now + lost)
        if self.n > self.n_continuous:
            parts_after.append(self.updates(x, u, like) + lost)
        y = self.outputs(torch.cat(parts_after, dim=1) if self.ahead else x, u, like) + lost
        reached = torch.zeros_like(y.narrow(1, 0, 1), dtype=torch.bool)
        outputs = y
        if self.limited:
            y, outputs, _, reached = self.limits(known, y, y)
        held = torch.zeros_like(reached)
        parts_after.append(together.index_select(1, self.line_columns))
        return outputs, torch.cat(parts_after, dim=1), held, reached

    def traced(self) -> None:
        """Put traces in the place of the programs, so that the step can be scripted."""
        like = torch.zeros(2, dtype=torch.float64)
        for name in ("slopes", "updates", "outputs"):
            program = getattr(self, name)
            u = torch.zeros(2, len(self.given) + (name == "slopes"), dtype=torch.float64)
            if program.listing.results:
                example = (torch.ones(2, self.n, dtype=torch.float64), u, like)
                with warnings.catch_warnings():  # the points of tables are constants, as the warning wants them to be
                    warnings.filterwarnings("ignore", message="torch.tensor results are registered as constants")
                    setattr(self, name, torch.jit.trace(program, example, check_trace=False))  # type: ignore[no-untyped-call]
            else:
                setattr(self, name, Nothing())


class Nothing(nn.Module):
    """A program without results, which is not run."""

    def forward(self, x: Tensor, u: Tensor, like: Tensor) -> Tensor:  # noqa: ARG002 - what every program is given
        """Nothing of it."""
        return x
