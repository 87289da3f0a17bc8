"""What a fitted valve does to a train: fit, run the scenarios, print the differences. Not collected by pytest.

Run with ``python tests/benchmarks/rail_consequence.py [seconds]``: a NARX network ``BP+AR+ER -> BC`` is fitted for so
many seconds (default 60) on three valves of a train of 101 vehicles, put at each of its 50 valves on the reference
pipe, and judged by the scenarios. A fit that the clock ends differs a little from machine to machine.
"""

from __future__ import annotations

import sys

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.sequences import RandomCommand
from sysid.airbrake.simulate import simulate
from sysid.estimation import Training, fit_narx
from sysid.models import NARX, AbstractModel, Mapping
from sysid.rail.brake import ReferenceBrake
from sysid.rail.judge import compare, tolerable_mse
from sysid.rail.scenario_catalogue import standard_scenarios
from sysid.rail.surrogate import Stage, ValveSurrogateBrake
from sysid.rail.train import heavy_haul
from sysid.traces import Channel, Trace
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA, Reference

CONSIST = Consist(pairs=50)
CHANNELS = {"BP": "pipe", "AR": "auxiliary", "ER": "emergency", "BC": "cylinder"}
COMMANDS = {
    "service": [[0, 90], [10, 84.2], [50, 64.2], [110, 90], [230, 77], [290, 64.2], [330, 90], [430, 90]],
    "emergency": [[0, 90], [10, 0], [70, 90], [200, 90]],
    "half": [[0, 90], [10, 77], [50, 90], [110, 64.2], [250, 64.2]],
}


def valve_trace(name: str, command: Command, node: int) -> Trace:
    """Pressures of one valve."""
    probes = tuple(Probe(quantity=quantity, node=node) for quantity in CHANNELS.values())
    record = simulate(command, consist=CONSIST, probes=probes)
    channels = tuple(Channel(name=channel, unit="psi", reference=Reference.GAUGE) for channel in CHANNELS)
    values = (record.pressures - STANDARD_ATMOSPHERE_PA) / PSI_IN_PA
    return Trace(name=f"{name}, node {node}", sample_time=0.1, channels=channels, values=values)


def fitted(seconds: float) -> AbstractModel:
    """A valve by the workbench itself."""
    traces = [
        valve_trace(name, Command.from_rows(rows), node) for node in (3, 51, 101) for name, rows in COMMANDS.items()
    ]
    selection = valve_trace("random", RandomCommand(duration=400.0, emergency=0.1).draw(5), 75)
    network = NARX(input_delays="0:3", output_delays=4, neurons=20)
    training = Training(max_iterations=3000, patience=200, max_time_s=seconds, seed=2, workers=1)
    fit = fit_narx(traces, Mapping.parse("BP+AR+ER -> BC"), network, training, rest_output=0.0, selection=[selection])
    return fit.model


def main() -> None:
    """Print both tables."""
    stage = Stage(models=(fitted(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0),))
    scenarios = standard_scenarios(heavy_haul(pairs=50))
    comparison = compare(
        scenarios,
        reference=lambda: ReferenceBrake(consist=CONSIST),
        other=lambda: ValveSurrogateBrake(stages=[stage], consist=CONSIST),
    )
    for name, d in comparison.differences.items():
        print(
            f"{name:<22} mse {d.mse:6.3f} psi2, distance {100 * d.distance:+6.2f} %, time {100 * d.time:+6.2f} %, "
            f"largest force {100 * d.force:+6.2f} %, speed {d.speed:.3f} m/s"
        )
    chosen = {name: scenarios[name] for name in ("full service", "emergency")}
    for biased in (True, False):
        for figure in ("distance", "force"):
            found = tolerable_mse(
                chosen,
                reference=lambda: ReferenceBrake(consist=CONSIST),
                sizes=(0.05, 0.1, 0.2, 0.5, 1.0, 2.0),
                figure=figure,
                biased=biased,
            )
            kind = "bias" if biased else "noise"
            print(f"{figure} within 1 % under {kind} up to a mean square error of {found.mse:.3g} psi2")


if __name__ == "__main__":
    main()
