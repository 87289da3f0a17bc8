"""The exported C under the address and undefined-behaviour sanitizers and valgrind.

    python -m tests.benchmarks.export_sanitizers

1,000 random sequences each over a single model, one with long lags, one with gates, a neural state space, models in a
circle, and a whole cascade, in double and float, in range and far out of it, with infinities and numbers that are not.
Ends with an error if anything is found.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from sysid.export import EXPORTERS, Surrogate
from sysid.models import NARX, Cascade, Limit, NeuralStateSpace, NeuralStateSpaceModel
from tests.benchmarks.export import RANGES, build, cascade

SEQUENCES = 1000
MAIN = """
#include "NAME.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
static uint64_t seed = 88172645463325252u;
static double draw(void) /* xorshift, between 0 and 1 */
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (double)(seed >> 11) / 9007199254740992.0;
}
int main(int argc, char **argv)
{
    const long samples = argc > 1 ? atol(argv[1]) : 200;
    static const double odd[] = {HUGE_VAL, -HUGE_VAL, 1e300, -1e300, 1e-310, -0.0};
    long sequence, i, flagged = 0, lost = 0;
    int k;
    for (sequence = 0; sequence < SEQUENCES; sequence++) {
        /* on the heap and of their exact size, so that a step beyond an end is seen */
        NAME_state *state = malloc(sizeof *state);
        NAME_real *in = malloc(PREFIX_N_INPUTS * sizeof *in), *out = malloc(PREFIX_N_OUTPUTS * sizeof *out);
        const double reach = sequence % 3 == 2 ? 1e4 : 90.0;
        for (k = 0; k < PREFIX_N_INPUTS; k++) in[k] = (NAME_real)(reach * draw());
        NAME_init(state, in, sequence % 2 ? 0 : out_at_rest(out));
        for (i = 0; i < samples; i++) {
            if (draw() < 0.1)
                for (k = 0; k < PREFIX_N_INPUTS; k++) in[k] = (NAME_real)(reach * draw());
            if (sequence % 10 == 9 && i == samples / 2) in[0] = (NAME_real)NAN;
            if (sequence % 10 == 8 && i == samples / 2) in[0] = (NAME_real)odd[(sequence / 10) % 6];
            flagged += NAME_step(state, in, out) != 0;
            for (k = 0; k < PREFIX_N_OUTPUTS; k++) lost += out[k] != out[k];
        }
        free(state);
        free(in);
        free(out);
    }
    printf("%ld sequences, %ld steps, %ld flagged, %ld outputs not a number\\n", (long)SEQUENCES, SEQUENCES * samples,
           flagged, lost);
    return 0;
}
"""
AT_REST = """
static NAME_real *out_at_rest(NAME_real *out)
{
    int k;
    for (k = 0; k < PREFIX_N_OUTPUTS; k++) out[k] = (NAME_real)(50.0 * draw());
    return out;
}
int main("""


def space() -> NeuralStateSpaceModel:
    """A neural state space with random weights and slow states."""
    network = NeuralStateSpace(states=3, neurons=8, output_neurons=4)
    sizes, like = network.sizes(2), build("BP+AR -> BC", NARX(input_delays=1, output_delays=1, neurons=1), 2)
    theta = 0.1 * np.random.default_rng(5).normal(size=sizes.count)
    theta[sizes.linear] = np.concatenate([np.diag([0.99, 0.9, 0.8]), np.full((3, 3), 0.05)], axis=1).ravel()
    fields = ("scaling", "mapping", "sample_time", "input_units", "output_unit", "rest_output")
    return NeuralStateSpaceModel(network=network, theta=theta, **{name: getattr(like, name) for name in fields})


def circle() -> Cascade:
    """Two models that read each other's past."""
    return Cascade(
        models=(
            build("STP+AR -> BP", NARX(input_delays=[[0, 1], [1, 3]], output_delays=2, neurons=10), 1),
            build("BP -> AR", NARX(input_delays="0:1", output_delays=1, neurons=6, gated=True), 2),
        ),
        limits={"AR": Limit(low=0.0, high="BP")},
    )


def programs(surrogate: Surrogate, folder: Path, *flags: str) -> None:
    """Write, compile and run under each of the tools; raises if one of them finds something."""
    prefix = surrogate.identifier
    EXPORTERS["c"].write(surrogate, folder)
    text = MAIN.replace("int main(", AT_REST.lstrip(), 1).replace("SEQUENCES", f"{SEQUENCES}L")
    (folder / "random.c").write_text(text.replace("NAME", prefix).replace("PREFIX", prefix.upper()))
    common = ["gcc", "-std=c99", "-g", *flags, "random.c", f"{prefix}.c", "-lm"]
    sanitizers = ["-O1", "-fsanitize=address,undefined,float-divide-by-zero", "-fno-sanitize-recover=all"]
    subprocess.run([*common, *sanitizers, "-o", "sanitized"], cwd=folder, check=True)
    subprocess.run([*common, "-O2", "-o", "plain"], cwd=folder, check=True)
    memcheck = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--track-origins=no"]
    for tool, command in {"sanitizers": ["./sanitized"], "valgrind": [*memcheck, "./plain", "50"]}.items():
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        sys.stdout.write(f"{prefix} {' '.join(flags)} {tool}: exit {done.returncode}, {done.stdout.strip()}\n")
        if done.returncode or done.stderr.strip():
            sys.stderr.write(done.stderr)
            raise SystemExit(1)


def main() -> None:
    """Every surrogate in both number types."""
    surrogates = [
        Surrogate.of(build("BP+AR -> BC", NARX(input_delays=4, output_delays=4, neurons=20), 2), RANGES),
        Surrogate.of(
            build("STP -> BP", NARX(input_delays=[0, 1, 2, 64], output_delays=[1, 128], neurons=5), 2), RANGES
        ),
        Surrogate.of(
            build("BP+AR -> BC", NARX(input_delays="0:1", output_delays=2, neurons=12, gated=True), 2), RANGES
        ),
        Surrogate.of(space(), RANGES),
        Surrogate.of(circle(), RANGES),
        cascade(),
    ]
    for surrogate in surrogates:
        for flags in ([], [f"-D{surrogate.identifier.upper()}_FLOAT"]):
            with tempfile.TemporaryDirectory() as folder:
                programs(surrogate, Path(folder), *flags)


if __name__ == "__main__":
    main()
