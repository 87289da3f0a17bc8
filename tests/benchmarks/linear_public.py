"""Linear models on two public benchmarks, beside published figures of linear models.

    SYSID_DATA=<folder> python -m tests.benchmarks.linear_public

The folder holds ``cascaded_tanks/dataBenchmark.csv`` (4TU 10.4121/12960104) and ``silverbox/SNLS80mV.csv``
(nonlinearbenchmark.org); neither is part of this project, each is checked by its SHA-256. Orders are chosen on
estimation data alone. Published: Champneys et al., "Baseline results for selected nonlinear system identification
benchmarks", arXiv 2405.10779: for each figure the better of its linear rows (ARX, linear state space), with 5 initial
samples on the tanks and 50 on the Silverbox.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import FitResult, fit_arx, fit_transfer_function
from sysid.estimation.linear.order_search import OrderGrid, search_orders
from sysid.models import Mapping, Start, StartKind, TransferFunction
from sysid.traces import Channel, Trace
from sysid.validation.order_finalists import free_run_figures, run_finalists
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked

CHANNELS = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
MAPPING = Mapping.parse("u -> y")
SOURCE = "Champneys et al. 2024"


def trace(name: str, columns: np.ndarray, sample_time: float) -> Trace:
    return Trace(name=name, sample_time=sample_time, channels=CHANNELS, values=columns)


def rmse(fit: FitResult, case: Trace, start: Start) -> float:
    return float(np.sqrt(free_run_figures(fit, case, start).mse))


def tanks() -> None:
    """Two lags in series, as two tanks in series suggest, beside an ARX search."""
    data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
    estimation = trace("estimation", np.column_stack([data["uEst"], data["yEst"]]), 4.0)
    test = trace("test", np.column_stack([data["uVal"], data["yVal"]]), 4.0)
    start = Start(kind=StartKind.MEASURED, n_measured=5)
    published = f"0.588 (state space), 0.685 (ARX); {SOURCE}"
    print("Cascaded Tanks, free run on the test record, RMSE")
    two = fit_transfer_function([estimation], MAPPING, TransferFunction(poles=(2,), zeros=(0,)), start=start)
    note = "order from the physics: two lags in series"
    name = f"Cascaded Tanks, {two.model.structure.label}"
    found(name, rmse(two, test, start), "V", target=0.588, published=published, note=note)
    first, second = (trace(n, estimation.values[s], 4.0) for n, s in (("a", slice(700)), ("b", slice(700, None))))
    losses = search_orders([first], MAPPING, OrderGrid(max_na=10, max_nb=10, max_nk=4), start=start)
    best = run_finalists(losses, [first], MAPPING, [second], count=200, start=start).best.fit
    note = "order chosen on the last 324 samples of the estimation record"
    found(f"Cascaded Tanks, {best.model.structure.label}", rmse(best, test, start), "V", published=published, note=note)


def silverbox() -> None:
    """An ARX search; three quarters of the multisine estimate, of which the last fifth chooses."""
    values = np.genfromtxt(checked("silverbox/SNLS80mV.csv"), delimiter=",", skip_header=1, usecols=(0, 1))
    period = 1.0 / 610.35
    multisine = values[40650:127400]
    split = int(0.75 * len(multisine))
    tests = {
        "multisine": (multisine[split:], 6.95),
        "arrow": (values[100:40575], 14.2),
        "arrow, no extrapolation": (values[100:32100], 6.58),
    }
    start = Start(kind=StartKind.MEASURED, n_measured=50)
    estimation = trace("estimation", multisine[:split], period)
    fitted, chooses = (trace(n, multisine[s], period) for n, s in (("a", slice(52000)), ("b", slice(52000, split))))
    losses = search_orders([fitted], MAPPING, OrderGrid(max_na=20, max_nb=20, max_nk=1), start=start)
    chosen = run_finalists(losses, [fitted], MAPPING, [chooses], count=120, start=start).best.fit.model.structure
    print("Silverbox, free run, RMSE")
    arx = fit_arx([estimation], MAPPING, chosen, start=start)
    six = TransferFunction(poles=(6,), zeros=(5,), delays=(0,))
    for fit in (arx, fit_transfer_function([estimation], MAPPING, six, start=start)):
        for name, (columns, published) in tests.items():
            error = 1e3 * rmse(fit, trace(name, columns, period), start)
            label = f"Silverbox {name}, {fit.model.structure.label}"
            target = published if fit is arx else None
            found(label, error, "mV", target=target, published=f"{published} (best linear row; {SOURCE})")


if __name__ == "__main__":
    tanks()
    silverbox()
