"""The static curves of a block-oriented model, as its free run goes over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeGuard

import numpy as np
from numpy.typing import NDArray

from sysid.equations.system import written_name
from sysid.errors import ConfigError
from sysid.models.blocks.block_oriented import HammersteinWiener, WienerHammerstein
from sysid.models.blocks.built_model import BuiltModel
from sysid.models.blocks.curves import NONE, Text
from sysid.models.channels.history import History
from sysid.models.contract.base import AbstractModel
from sysid.models.grey_box.grey_box import lowered

Array = NDArray[np.float64]
POINTS: Final = 400
BINS: Final = 40
"""Points of a curve that a picture shows, and bars that say where samples lie."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveValues:
    """What one curve is given and what it makes of it, sample by sample.

    Args:
        title: Which curve.
        before: What it is given, with its unit.
        behind: What it gives, with its unit.
        x: Shape ``(n_samples,)``.
        y: Shape ``(n_samples,)``.
    """

    title: str
    before: str
    behind: str
    x: Array
    y: Array

    def drawn(self) -> CurvePoints:
        """What a picture of it needs, however long the record is."""
        x, first = np.unique(self.x, return_index=True)
        some = np.unique(np.linspace(0, len(x) - 1, min(POINTS, len(x))).astype(int))
        counts, edges = np.histogram(self.x, bins=BINS)
        return CurvePoints(
            title=self.title, before=self.before, behind=self.behind,
            x=x[some], y=self.y[first][some], edges=edges, counts=counts.astype(np.float64),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvePoints:
    """A curve as it is drawn and stored: some of its points, and how many samples lie where.

    Args:
        title: Which curve.
        before: What it is given, with its unit.
        behind: What it gives, with its unit.
        x: Rising, shape ``(n_points,)``.
        y: Shape ``(n_points,)``.
        edges: Of the parts of its range, shape ``(n_bins + 1,)``.
        counts: Samples in each part, shape ``(n_bins,)``.
    """

    title: str
    before: str
    behind: str
    x: Array
    y: Array
    edges: Array
    counts: Array

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "title": self.title, "before": self.before, "behind": self.behind,
            **{name: getattr(self, name).tolist() for name in ("x", "y", "edges", "counts")},
        }  # fmt: skip


def curve_values(model: AbstractModel, records: Sequence[tuple[Array, History]]) -> tuple[CurveValues, ...]:
    """The curves of a Hammerstein-Wiener or Wiener-Hammerstein model over some records.

    Args:
        model: The model.
        records: Inputs of each, shape ``(n_samples, n_inputs)``, and what stands before.

    Returns:
        One for each curve, inputs first. What lies between curve and block has no unit and is scaled.

    Raises:
        ConfigError: If the model has no curves.
    """
    if not has_curves(model):
        raise ConfigError(
            "the model has no static curves",
            where="structure",
            expected="a HammersteinWiener or WienerHammerstein model with a curve",
            got=model.structure.label,
            remedy="plot its free run in place of them: fit.plot()",
        )
    return tuple(
        CurveValues(title=title, before=before, behind=behind, x=_run(model, x, records), y=_run(model, y, records))
        for title, before, behind, x, y in _wanted(model)
    )


def has_curves(model: AbstractModel) -> TypeGuard[BuiltModel]:
    """Whether a model has static curves that can be drawn."""
    return isinstance(model, BuiltModel) and bool(_wanted(model))


def _wanted(model: BuiltModel) -> list[tuple[str, str, str, str, str]]:
    """Title, what stands before and behind, and the two as expressions of the equations, of each curve."""
    structure, mapping = model.structure, model.mapping
    text = Text(taken=frozenset((*mapping.inputs, *mapping.outputs)))
    wanted: list[tuple[str, str, str, str, str]] = []
    if isinstance(structure, HammersteinWiener):
        n = len(mapping.inputs)
        each = zip(mapping.inputs, model.input_units, structure.curves(n), structure.lags(n), strict=True)
        for j, (name, unit, curve, lag) in enumerate(each, start=1):
            tag = f"f{j}" if n > 1 else "f"
            read = written_name(name) + (f"[k-{lag - 1}]" if lag > 1 else "")
            behind = text.name(f"{tag}_in" if curve.given else f"{tag}_out")
            if curve.kind != NONE:
                wanted.append((f"{name}: {curve}", f"{name} [{unit}]", "into the block, scaled", read, behind))
        if structure.output.kind != NONE:
            x = text.name("unbent" if structure.output.given else "inside")
            label = "out of the block" + (f" [{model.output_unit}]" if structure.output.given else ", scaled")
            y = _right(model)
            title = f"{mapping.output}: {structure.output}"
            wanted.append((title, label, f"{mapping.output} [{model.output_unit}]", x, y))
    elif isinstance(structure, WienerHammerstein):
        x, y = text.name("between"), text.name("bent")
        title = f"between the blocks: {structure.curve}"
        wanted.append((title, "out of the first block, scaled", "into the second, scaled", x, y))
    return wanted


def _right(model: BuiltModel) -> str:
    """What the output is, as the last equation has it."""
    return model.grey.equations.splitlines()[-1].removeprefix(f"{written_name(model.mapping.output)} = ")


def _run(model: BuiltModel, expression: str, records: Sequence[tuple[Array, History]]) -> Array:
    """What an expression of the equations is over some records, one after the other."""
    mapping = model.mapping
    lines = model.grey.equations.splitlines()[:-1]
    kept = Text(taken=frozenset((*mapping.inputs, *mapping.outputs))).name("whole")  # so that all parameters are read
    right, own = _right(model), model
    if expression != right:
        lines += [f"{kept} = {right}", f"{written_name(mapping.output)} = {expression}"]
        grey = replace(model.grey, equations="\n".join(lines))
        low = lowered(grey, mapping.inputs, mapping.outputs, model.sample_time)
        # Networks that are run are the first: only that of the last line may be gone, and its weights with it.
        theta = model.theta[: len(grey.free) + low.n_weights]
        own = replace(model, grey=grey, theta=theta, norms=model.norms[: len(low.norms)])
    form, cut = model.recursion, own.recursion
    runs = [cut.run(cut.given(u, history.inputs), np.array(form.state(history))) for u, history in records]
    return np.concatenate(runs)[:, 0]
