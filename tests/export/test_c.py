"""The C source as its receivers compile it: any compiler, either number type, no warning, no library but libm."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.export import EXPORTERS, Surrogate
from sysid.export.c.compiler import CompilerError, build_library
from sysid.export.c.source import PASSED_OVER, c_files
from sysid.export.forms.incremental import IncrementalForm
from sysid.export.forms.lagged import LaggedForm
from sysid.models import NARX
from tests.export.grey_boxes import GREY_BOXES

STRICT = ["-O2", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"]
RECEIVERS = {
    "C99": ["gcc", "-std=c99"],
    "C17": ["gcc", "-std=c17"],
    "C++98": ["g++", "-x", "c++", "-std=c++98"],
    "C++17": ["g++", "-x", "c++", "-std=c++17"],
    "32 bits": ["gcc", "-m32", "-std=c99"],
    "fast mathematics": ["gcc", "-std=c99", "-ffast-math", "-Wno-unused-function"],
}

# What a receiver writes: two instances side by side, an end in the middle, a copy of the state.
MAIN = """
#include "NAME.h"
#include <stdio.h>
#include <stdlib.h>
int main(int argc, char **argv)
{
    NAME_state a, b, kept;
    NAME_real in[PREFIX_N_INPUTS], other[PREFIX_N_INPUTS], out[PREFIX_N_OUTPUTS];
    double number;
    unsigned int flags;
    int i, n = 0;
    (void)argc;
    (void)argv;
    for (;;) {
        for (i = 0; i < PREFIX_N_INPUTS; i++) {
            if (scanf("%lf", &number) != 1) return 0;
            in[i] = (NAME_real)number;
            other[i] = (NAME_real)(90.0 - number);
        }
        if (n == 0) { NAME_init(&a, in, 0); NAME_init(&b, other, 0); }
        if (n == 17) { kept = a; NAME_step(&a, other, out); a = kept; }
        NAME_step(&b, other, out);
        flags = NAME_step(&a, in, out);
        for (i = 0; i < PREFIX_N_OUTPUTS; i++) printf("%.17g ", (double)out[i]);
        printf("%u\\n", flags);
        n++;
    }
}
"""


def can_compile(command, folder):
    """Whether this machine has the compiler with its headers, for this target."""
    (folder / "probe.c").write_text(
        "#include <math.h>\n#include <string.h>\nint probe(void);\nint probe(void) { return 0; }\n"
    )
    if not shutil.which(command[0]):
        return False
    probe = [*command, "-c", "probe.c", "-o", "probe.o"]
    return subprocess.run(probe, cwd=folder, capture_output=True, check=False).returncode == 0


@pytest.fixture(scope="module")
def sources(models, declared, cascade, circle, tmp_path_factory):
    """Folder and name of the C files of every model, of a cascade, and of models in a circle."""
    found, wired = {}, {"cascade": cascade, "circle": circle, "equations": Surrogate.of(GREY_BOXES["stiff"]())}
    for name, surrogate in {**{name: declared(build()) for name, build in models.items()}, **wired}.items():
        folder = tmp_path_factory.mktemp("c")
        EXPORTERS["c"].write(surrogate, folder)
        found[name] = (surrogate, folder)
    return found


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("receiver", RECEIVERS)
def test_no_compiler_has_a_word_to_say(sources, receiver, real, tmp_path):
    command = RECEIVERS[receiver]
    if not can_compile(command, tmp_path):
        pytest.skip(f"this machine cannot compile with {' '.join(command)}")
    thorough = receiver == "C99"  # what depends on the model alone is seen by any one compiler
    for key in sources if thorough else ("NARX, delays per input", "ARX, no input used", "cascade"):
        surrogate, folder = sources[key]
        name = surrogate.identifier
        macro = [f"-D{name.upper()}_FLOAT"] if real == "float" else []
        done = subprocess.run(
            [*command, *STRICT, *macro, "-c", f"{name}.c", "-o", tmp_path / "out.o"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")


ANALYSES = {
    # GCC 12 takes the width of a vector's element for its number of elements, which is told to it.
    "gcc -fanalyzer": ["gcc", "-std=c99", "-O1", "-fanalyzer", "-Werror", "-Wno-analyzer-shift-count-overflow", "-c"],
    "cppcheck": ["cppcheck", "--std=c99", "--enable=warning,performance,portability", "--inconclusive", "--quiet",
                 "--error-exitcode=1", "--suppress=missingIncludeSystem"],
}  # fmt: skip
"""What looks for mistakes without running the source."""


@pytest.mark.parametrize("macro", ["", "FLOAT"], ids=["double", "float"])
@pytest.mark.parametrize("tool", ANALYSES)
def test_static_analysis_finds_nothing(sources, tool, macro, tmp_path):
    command = ANALYSES[tool]
    if not shutil.which(command[0]):
        pytest.skip(f"this machine has no {command[0]}")
    for key in ("NARX, gates of tanh", "cascade", "circle") if tool == "cppcheck" else ("NARX, gates of tanh",):
        surrogate, folder = sources[key]
        name = surrogate.identifier
        flags = ["-D__GNUC__=12"] if tool == "cppcheck" else ["-o", tmp_path / "out.o"]
        flags += [f"-D{name.upper()}_{macro}"] if macro else []
        done = subprocess.run([*command, *flags, f"{name}.c"], cwd=folder, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("macro", ["", "LIBM_TANH", "FLOAT"], ids=["double", "tanh of libm", "float"])
@pytest.mark.parametrize("receiver", ["C99", "C++17"])
@pytest.mark.parametrize("name", ["NARX 4/4/20", "cascade"])
def test_a_program_around_it_gets_what_the_model_gives(*, sources, inputs, name, receiver, macro, tmp_path):
    surrogate, folder = sources[name]
    prefix, u = surrogate.identifier, inputs(200, len(surrogate.inputs))
    text = MAIN.replace("NAME", prefix).replace("PREFIX", prefix.upper())
    (tmp_path / "main.c").write_text(text)
    macros = [f"-D{prefix.upper()}_{macro}"] if macro else []
    files = [tmp_path / "main.c", folder / f"{prefix}.c"]
    command = [*RECEIVERS[receiver], "-O2", *macros, f"-I{folder}", *files, "-o", tmp_path / "run", "-lm"]
    subprocess.run(command, check=True)
    fed = "\n".join(" ".join(map(repr, row)) for row in u.tolist())
    done = subprocess.run([tmp_path / "run"], input=fed, capture_output=True, text=True, check=True)
    rows = np.array([line.split() for line in done.stdout.splitlines()], dtype=np.float64)
    tolerance = 1e-3 if macro == "FLOAT" else 1e-9
    np.testing.assert_allclose(rows[:, :-1], surrogate.simulate(u), rtol=0.0, atol=tolerance)


@pytest.mark.parametrize(
    ("flag", "own"), [("-O2", True), ("-mavx512fp16", True), ("-mfpmath=387", False), ("-ffast-math", False)]
)
def test_the_tanh_of_its_own_is_taken_where_sums_are_computed_as_written(*, sources, flag, own):
    """Arithmetic in half precision is no reason against it: libm's takes four times as long."""
    surrogate, folder = sources["NARX 4/4/20"]
    command = ["gcc", "-E", "-dM", flag, f"{surrogate.identifier}.c"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if "unrecognized" in done.stderr:
        pytest.skip(f"this compiler does not know {flag}")
    assert ("#define TANH_LANES" in done.stdout) is own


NUMBERS = {
    "double": ([], "nextafter((double)fabsl(exact), 2.0) - (double)fabsl(exact)", 5.0),
    "float": (["-D{P}_FLOAT"], "nextafterf((float)fabsl(exact), 2.0f) - (float)fabsl(exact)", 5.0),
}


@pytest.mark.parametrize("number", NUMBERS)
def test_tanh_is_libms_within_a_few_units_in_the_last_place(*, sources, number, tmp_path):
    surrogate, folder = sources["NARX 4/4/20"]
    flags, unit, most = NUMBERS[number]
    smallest = 390 if number == "float" else 4000
    (tmp_path / "main.c").write_text(
        f"""
        #include "{folder}/{surrogate.identifier}.c"
        #include <stdio.h>
        int main(void)
        {{
            double worst = 0.0;
            real x;
            long i;
            for (i = 0; i < 2000000; i++) {{
                x = (real)(i % 2 ? 1e-5 * (double)i - 10.0
                    : pow(10.0, -(double)(i % {smallest}) / 13.0) * (1.0 + (double)i * 4e-7));
                if (x > R(20.0)) x = R(20.0);
                {{
                    const long double exact = tanhl((long double)x);
                    const double unit = (double)({unit});
                    const double off = (double)(fabsl((long double)tanh_near(x) - exact) / unit);
                    if (off > worst) worst = off;
                }}
            }}
            printf("%.3f %d %d\\n", worst, tanh_near(20.0) == 1.0, tanh_near(NAN) != tanh_near(NAN));
            return 0;
        }}
        """
    )
    command = ["gcc", "-std=c99", "-O2", *(flag.format(P=surrogate.identifier.upper()) for flag in flags), "main.c"]
    subprocess.run([*command, "-o", "run", "-lm"], cwd=tmp_path, check=True)
    worst, one, lost = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout.split()
    assert 0.5 <= float(worst) <= most
    assert (one, lost) == ("1", "1")


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("target", ["-O2", "-O3 -march=native"])
def test_neurons_side_by_side_are_what_each_is_alone(*, sources, target, number, tmp_path):
    """In layers of every width, whole registers or not; and nothing is written behind a layer."""
    surrogate, folder = sources["NARX 4/4/20"]
    (tmp_path / "main.c").write_text(
        f"""
        #include "{folder}/{surrogate.identifier}.c"
        #include <stdio.h>
        #ifndef TANH_LANES
        #error "GCC has vectors"
        #endif
        #define WIDEST (2 * LANES + 3)
        int main(void)
        {{
            static real weights[3 * WIDEST];
            real constants[WIDEST], sums[WIDEST + 1], layer[WIDEST + 1];
            const real x[3] = {{R(0.5), R(-0.25), R(2.0)}};
            long i, different = 0;
            int n, k;
            for (i = 0; i < 4000; i++) {{
                for (n = 1; n <= WIDEST; n++) {{
                    /* whole numbers, so that sums are exact in any order */
                    for (k = 0; k < n; k++) constants[k] = (real)((k - 3) * (i % 61));
                    for (k = 0; k < 3 * n; k++) weights[k] = (real)((k % 5 - 2) * (i % 7));
                    sums[n] = layer[n] = R(7.0);
                    weigh(sums, constants, weights, n, x, 3);
                    for (k = 0; k < n; k++) {{
                        const real sum = constants[k] + R(0.5) * weights[k] - R(0.25) * weights[n + k]
                            + R(2.0) * weights[2 * n + k];
                        different += sums[k] != sum;
                        sums[k] = (real)(1e-3 * (double)((k - 3) * i));
                    }}
                    sums[i % n] = (real)(i % 4 == 0 ? 1e-30 : i % 4 == 1 ? NAN : i % 4 == 2 ? INFINITY : -INFINITY);
                    activate(layer, sums, n);
                    for (k = 0; k < n; k++) {{
                        real alone = sums[k] > R(20.0) ? R(20.0) : sums[k] < R(-20.0) ? R(-20.0) : sums[k];
                        alone = tanh_near(alone);
                        different += alone == alone ? layer[k] != alone : layer[k] == layer[k];
                    }}
                    different += sums[n] != R(7.0) || layer[n] != R(7.0);
                }}
            }}
            printf("%ld\\n", different);
            return 0;
        }}
        """
    )
    flags = [flag.format(P=surrogate.identifier.upper()) for flag in NUMBERS[number][0]]
    command = ["gcc", "-std=c99", *target.split(), *flags, "main.c", "-o", "run", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["0"]


def test_parameters_are_written_to_the_last_bit(sources):
    surrogate, folder = sources["NARX 4/4/20"]
    text = (folder / f"{surrogate.identifier}.c").read_text()
    written = {float(number) for number in re.findall(r"R\(([-+.e0-9]+)\)", text)}
    form = LaggedForm.of(surrogate.stages[0].model)
    incremental = IncrementalForm.of(form)
    numbers = (incremental.hidden_weights, incremental.linear, form.hidden_bias, form.readout, form.constant)
    assert {float(number) for part in numbers for number in part.ravel()} <= written


def test_it_allocates_nothing_and_networks_do_not_even_need_libm(sources, tmp_path):
    copies = {"memmove", "memcpy", "__stack_chk_fail", "_GLOBAL_OFFSET_TABLE_"}
    for name, (surrogate, folder) in sources.items():
        subprocess.run(["gcc", "-O2", "-c", folder / f"{surrogate.identifier}.c", "-o", tmp_path / "x.o"], check=True)
        listed = subprocess.run(["nm", "-u", tmp_path / "x.o"], capture_output=True, text=True, check=True).stdout
        functions = (
            {"exp", "memset", "pow", "sin", "sincos", "sqrt"} if name == "equations" else set()
        )  # which they are made of
        assert {line.split()[-1] for line in listed.splitlines()} <= copies | functions


def test_the_header_says_of_which_output_init_reads_no_level():
    files = c_files(Surrogate.of(GREY_BOXES["declared states"](), {"BP": (0.0, 80.0), "AR": (0.0, 80.0)}))
    assert f"BC [psi], {PASSED_OVER}" in next(text for name, text in files.items() if name.endswith(".h"))


def test_units_and_ranges_stand_in_the_header(sources):
    surrogate, folder = sources["NARX 4/4/20"]
    header = (folder / f"{surrogate.identifier}.h").read_text()
    assert "BP_AR_TO_BC_INPUT_BP = 0, /* BP [psi], from 0.0 to 95.0 */" in header
    assert "BP_AR_TO_BC_OUTPUT_BC = 0 /* BC [psi], 0.0 */" in header
    assert "#define BP_AR_TO_BC_SAMPLE_TIME 0.1" in header


def test_channel_names_cannot_end_a_comment(models, declared, tmp_path):
    from dataclasses import replace

    from sysid.export import Surrogate
    from sysid.models import Mapping

    evil = replace(
        models["NARX 4/4/20"](),
        mapping=Mapping(inputs=("a */ int x; /*", 'b"\\\n#error'), output="é /* é"),
        output_unit="*/",
    )
    EXPORTERS["c"].write(Surrogate.of(evil), tmp_path)
    (source,) = tmp_path.glob("*.c")
    subprocess.run(["gcc", "-std=c99", *STRICT, "-c", source, "-o", tmp_path / "x.o"], check=True)


def test_without_a_compiler_the_user_is_told(models, declared, tmp_path, monkeypatch):
    exporter, surrogate = EXPORTERS["c"], declared(models["ARX"]())
    (file,) = exporter.write(surrogate, tmp_path)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(ConfigError, match=r"(?s)need a C compiler.*no-such-compiler.*install gcc"):
        exporter.load(file, tmp_path)


def test_a_source_that_does_not_compile_is_shown_with_the_compilers_words(tmp_path):
    (tmp_path / "broken.c").write_text("int x = ;")
    with pytest.raises(CompilerError, match=r"(?s)refuses.*broken\.c.*expected expression"):
        build_library(["broken.c"], tmp_path, "broken.so")


def test_a_long_memory_is_moved_not_copied_line_by_line(narx, declared, inputs, tmp_path):
    model = narx(NARX(input_delays=[1, 2, 4, 64], output_delays=[1, 32], neurons=3))
    surrogate, exporter = declared(model), EXPORTERS["c"]
    (file,) = exporter.write(surrogate, tmp_path)
    u = inputs(300, 2)
    run = exporter.load(file, tmp_path)(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
    np.testing.assert_allclose(run.output[:, 0], surrogate.simulate(u), rtol=0.0, atol=1e-9)
    text = (tmp_path / file.name).read_text()
    assert (text.count("memmove("), "past[62]" in text) == (3, False)
