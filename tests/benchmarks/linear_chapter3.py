"""The dissertation's chapter 3 again: ARX, order search, transfer functions, networks, and the verdict.

    python -m tests.benchmarks.linear_chapter3

On the built-in data set ab-linear, whose traces are this project's: published figures stand beside ours as a yardstick
of the method. Selection traces choose; the choice by the mean over all cases, which the dissertation made, stands
beside it.
"""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from sysid.estimation import FitResult, Training, fit_arx, fit_narx, fit_transfer_function
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import search_orders
from sysid.ingest import load_dataset
from sysid.models import ARX, NARX, Mapping, Start, TransferFunction
from sysid.traces import Role, TraceSet
from sysid.validation import Evaluation, analyse_residuals, evaluate, judge_linearity
from sysid.validation.order_finalists import run_finalists

DATASETS = Path(__file__).parents[2] / "datasets"
MAPPING = Mapping.parse("BP+AR -> BC")
REST = 0.0


def show(name: str, fit: FitResult, traces: TraceSet, found: dict[str, Evaluation]) -> None:
    """Print the NRMSE fits of the free run, and keep the evaluation."""
    evaluation = evaluate(fit.model, traces, Start(), repeats=1)
    found[name] = evaluation
    fits = "  ".join(f"{case} {result.free_run.nrmse_fit:6.2f}" for case, result in evaluation.cases.items())
    print(f"{name:34s} {fit.model.structure.label:24s} {fits}")


def main() -> None:
    """All of chapter 3."""
    traces, chosen_on = load_dataset(DATASETS / "ab-linear"), load_dataset(DATASETS / "ab-linear-selection")
    estimation, selection = traces.with_role(Role.ESTIMATION), chosen_on.with_role(Role.SELECTION)
    linear: dict[str, Evaluation] = {}
    networks: dict[str, Evaluation] = {}
    print("NRMSE fit of the free run in percent. Published: ARX 89.72 on EST01; transfer function 94 on EST01, 93 on")
    print("VAL01, more than 80 on VAL02 and VAL04, 98 on VAL03.")
    arx = fit_arx(estimation, MAPPING, ARX(na=1, nb=(30, 30), nk=(1, 1)), rest_output=REST)
    show("ARX of the dissertation", arx, traces, linear)
    losses = search_orders(estimation, MAPPING, OrderGrid(max_na=30, max_nb=30, max_nk=4), rest_output=REST)
    for name, cases in (("by selection", selection), ("by all cases", tuple(traces))):
        best = run_finalists(losses, estimation, MAPPING, cases, rest_output=REST).best
        show(f"ARX searched, {name}", best.fit, traces, linear)
        print(f"{'':34s} mean fit on what chose: {best.mean_fit:.2f}, standard deviation {best.std_fit:.2f}")
    pairs = [((19, 16), (14, 11)), ((19, 14), (16, 11)), *(((p, p), (p - 1, p - 1)) for p in (1, 2, 3, 5, 8, 12, 20))]
    for poles, zeros in pairs:
        structure = TransferFunction(poles=poles, zeros=zeros, delays=(1, 1))
        blind = fit_transfer_function(estimation, MAPPING, structure, rest_output=REST)
        show("transfer function, least loss", blind, traces, linear)
        seeing = fit_transfer_function(estimation, MAPPING, structure, rest_output=REST, selection=selection)
        show("transfer function, by selection", seeing, traces, linear)
        linear[f"TF {poles} {zeros}"] = linear.pop("transfer function, least loss")
        linear[f"TF {poles} {zeros}, selection"] = linear.pop("transfer function, by selection")
    analysis = analyse_residuals(arx.model, estimation)
    print(f"residuals of the ARX: {'white' if analysis.white else 'not white'}, Ljung-Box {analysis.ljung_box:.0f}")
    network = NARX(input_delays=2, output_delays=2, neurons=10)
    start = None
    for loop in ("open", "closed"):
        training = Training(loop=loop, max_iterations=200, starts=2, choose_by="selection")
        start = fit_narx(estimation, MAPPING, network, training, selection=selection, rest_output=REST)
        show(f"NARX, {loop} loop", start, traces, networks)
    verdict = judge_linearity(linear, networks)
    print(verdict.answer.value)
    for row in verdict.rows:
        network_fit = f"network {row.network_fit:.2f} %"
        print(f"  {row.amplitude.value:13s} {row.linear_fit:.2f} % ({row.linear}), {network_fit}")


if __name__ == "__main__":
    main()
