"""The exported C of published cascades beside a straight hand-written one with the same arithmetic.

    python -m tests.benchmarks export_c_by_hand

What a person writes who has the weights: for each model its regressors out of the delay lines, a loop over neurons
around a loop over regressors, ``tanh`` of libm, bounds and limits, and the lines moved on by ``memmove``; no flags.
Both are compiled with the same options and run the same 20,000 samples in programs of their own. That they compute the
same is told of the first samples: later these surrogates make more of rounding than that. Medians of processor time
over 101 runs.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.export import EXPORTERS, Surrogate, read_bundle
from sysid.export.forms.stage import Stage
from tests.benchmarks._findings import found
from tests.benchmarks.export import TIMING
from tests.benchmarks.export_cascades import CASCADES, feeds

SAMPLES, SAME = 20_000, 100
ALLOWED = 1.3
OPTIONS = {"-O2": ("-O2",), "-O3 -march=native": ("-O3", "-march=native")}


def array(values: np.ndarray) -> str:
    """Numbers as C writes them, to the last bit."""
    return ", ".join(f"(R){float(value)!r}" for value in np.asarray(values).ravel())


def stage_text(stage: Stage, number: int) -> str:
    """One model as a person would write it."""
    form, layout = stage.lagged
    n, m, h = form.n_inputs, form.n_outputs, form.neurons
    columns = [layout.column(channel, lag) for channel, own in enumerate(form.lags) for lag in own]
    d, past = len(columns), f"(past + {stage.first})"
    tables = {
        "G": form.gates if form.gated else [],
        "W": form.hidden_weights,
        "b": form.hidden_bias,
        "v": form.readout,
        "w": form.linear,
        "c": form.constant,
    }
    lines = [f"static const R {name}{number}[] = {{{array(t)}}};" for name, t in tables.items() if np.size(t)]
    lines += [f"static void stage{number}(R *past, R *known) {{", f"  R x[{d}], u[{max(n, 1)}], y[{m}]; int i, k;"]
    for i, source in enumerate(stage.known_sources):
        lines.append(f"  u[{i}] = (known[{source}] - (R){form.offset[i]!r}) / (R){form.scale[i]!r};")
    for i, column in enumerate(columns):
        lines.append(f"  x[{i}] = {f'u[{column}]' if column < n else f'{past}[{column - n}]'};")
    for j in range(m):
        lines.append(f"  y[{j}] = c{number}[{j}];")
        lines.append(f"  for (i = 0; i < {d}; i++) y[{j}] += w{number}[{j * d} + i] * x[i];")
    if h:
        lines.append(f"  for (k = 0; k < {h}; k++) {{ R a = b{number}[k];")
        lines.append(f"    for (i = 0; i < {d}; i++) a += W{number}[k * {d} + i] * x[i];")
        lines.append("    a = TANH(a);")
        if form.gated:
            lines.append(f"    R g = v{number}[k]; for (i = 0; i < {d}; i++) g += G{number}[k * {d} + i] * x[i];")
            lines += ["    y[0] += g * a;", "  }"]
        else:
            lines += [f"    y[{j}] += v{number}[{j * h} + k] * a;" for j in range(m)] + ["  }"]
    lines += limits_text(stage)
    newest = [f"u[{i}]" for i in range(n)] + [f"y[{j}]" for j in range(m)]
    for line, value in zip(layout.lines, newest, strict=True):
        if line.length > 1:
            lines.append(f"  memmove({past} + {line.first + 1}, {past} + {line.first}, {line.length - 1} * sizeof(R));")
        if line.length:
            lines.append(f"  {past}[{line.first}] = {value};")
    return "\n".join([*lines, "}", ""])


def limits_text(stage: Stage) -> list[str]:
    """Its outputs within bounds and limits, in units."""
    form, lines = stage.form, []
    n = form.n_inputs
    for j, target in enumerate(stage.targets):
        offset, scale = f"(R){form.offset[n + j]!r}", f"(R){form.scale[n + j]!r}"
        for sign, bound in (("<", form.low), (">", form.high)):
            if np.isfinite(bound):
                lines.append(f"  if (y[{j}] {sign} (R){bound!r}) y[{j}] = (R){bound!r};")
        lines.append(f"  known[{target}] = y[{j}] * {scale} + {offset};")
        for side in stage.limits[j]:
            limit = f"(R){side.value!r}" if side.column is None else f"known[{side.column}]"
            lines.append(f"  if (known[{target}] {'>' if side.upper else '<'} {limit}) {{ known[{target}] = {limit};")
            lines.append(f"    y[{j}] = (known[{target}] - {offset}) / {scale}; }}")
    return lines


def by_hand(surrogate: Surrogate) -> str:
    """The whole as one file that has the functions of the exported header."""
    p, n = surrogate.identifier, len(surrogate.inputs)
    at_rest = array(surrogate.at_rest(np.array([port.start for port in surrogate.inputs])))
    lines = [f'#include "{p}.h"', "#include <math.h>", "#include <string.h>", f"typedef {p}_real R;"]
    lines += [f"#ifdef {p.upper()}_FLOAT", "#define TANH tanhf", "#else", "#define TANH tanh", "#endif"]
    lines += [stage_text(stage, i) for i, stage in enumerate(surrogate.stages)]
    lines += [f"static const R rest[] = {{{at_rest}}};"]
    lines += [
        f"void {p}_init({p}_state *state, const R *in, const R *out)",
        "{ memcpy(state->past, rest, sizeof rest); }",
    ]
    lines += [
        f"unsigned int {p}_step({p}_state *state, const R *in, R *out) {{",
        f"  R known[{len(surrogate.channels)}];",
    ]
    lines += [f"  memcpy(known, in, {n} * sizeof(R));"]
    lines += [f"  stage{i}(state->past, known);" for i in range(len(surrogate.stages))]
    lines += [
        f"  state->past[{one.place}] = (known[{one.column}] - (R){one.offset!r}) / (R){one.scale!r};"
        for one in surrogate.late
    ]
    lines += [f"  out[{i}] = known[{column}];" for i, column in enumerate(surrogate.columns)] + ["  return 0u;", "}"]
    lines += [f"unsigned int {p}_run({p}_state *state, size_t n, const R *in, R *out, unsigned int *flags) {{"]
    lines += [f"  size_t i; for (i = 0; i < n; i++) {p}_step(state, in + i * {n}, out + i * {len(surrogate.outputs)});"]
    return "\n".join([*lines, "  return 0u;", "}", ""])


def outputs(surrogate: Surrogate, folder: Path, source: str, inputs: np.ndarray) -> np.ndarray:
    """What a source computes in double, from where it begins."""
    p = surrogate.identifier
    library = folder / f"{source}.so"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", source, "-lm", "-o", library], cwd=folder, check=True)
    loaded, state = ctypes.CDLL(str(library)), ctypes.create_string_buffer(8 * surrogate.state_size + 4096)
    given, out = np.ascontiguousarray(inputs), np.empty((len(inputs), len(surrogate.outputs)))
    start = np.array([port.start for port in surrogate.inputs])
    address = [array.ctypes.data_as(ctypes.c_void_p) for array in (start, given, out)]
    loaded[f"{p}_init"](state, address[0], None)
    loaded[f"{p}_run"](state, ctypes.c_size_t(len(inputs)), address[1], address[2], None)
    return out


def timed(surrogate: Surrogate, folder: Path, source: str, *flags: str) -> float:
    """Microseconds a sample, the median."""
    command = ["gcc", "-std=gnu99", *flags, "timing.c", source, "-lm", "-o", "timing"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run(["./timing", "inputs.txt"], cwd=folder, check=True, capture_output=True, text=True)
    return float(done.stdout.split()[0]) / 1e3 / SAMPLES


def compare(label: str, surrogate: Surrogate, folder: Path) -> None:
    """Both, with the same options, in both number types."""
    p = surrogate.identifier
    (file,) = EXPORTERS["c"].write(surrogate, folder)
    (folder / "hand.c").write_text(by_hand(surrogate), encoding="utf-8")
    (folder / "timing.c").write_text(TIMING.replace("NAME", p).replace("PREFIX", p.upper()))
    u, _ = feeds(surrogate, file, 1)
    inputs = np.resize(u[:, 0], (SAMPLES, u.shape[2]))
    np.savetxt(folder / "inputs.txt", inputs)
    both = [outputs(surrogate, folder, source, inputs[:SAME]) for source in (f"{p}.c", "hand.c")]
    apart = float(np.abs(both[0] - both[1]).max())
    found(f"{label}: largest difference of the two over {SAME} samples, double", apart, "psi", target=1e-9)
    for options, flags in OPTIONS.items():
        times = {}
        for kind, macro in (("double", ()), ("float", (f"-D{p.upper()}_FLOAT",))):
            hand = timed(surrogate, folder, "hand.c", *flags, *macro)
            ours = times[kind] = timed(surrogate, folder, f"{p}.c", *flags, *macro)
            libm = timed(surrogate, folder, f"{p}.c", *flags, *macro, f"-D{p.upper()}_LIBM_TANH")
            note = f"{ours:.3f} against {hand:.3f} µs a sample; with libm's tanh {libm / hand:.2f} x"
            found(f"{label}: C, {kind}, {options}, over by hand", ours / hand, "x", target=ALLOWED, note=note)
        note = f"{times['float']:.3f} against {times['double']:.3f} µs a sample"
        found(f"{label}: C, {options}, float over double", times["float"] / times["double"], "x", target=1.0, note=note)


def main() -> None:
    """Every published cascade."""
    for name in CASCADES:
        with tempfile.TemporaryDirectory() as folder:
            model = read_bundle(Path("reports") / name / "bundle").model
            compare(name, Surrogate.of(model, {"STP": (0.0, 90.0)}), Path(folder))


if __name__ == "__main__":
    main()
