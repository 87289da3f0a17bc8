"""C++ in one header, and the Arduino library: what their compilers and tools make of them."""

from __future__ import annotations

import json
import subprocess
import zipfile

import numpy as np
import pytest

from sysid.export import EXPORTERS, Surrogate, expected_flags
from sysid.export.c.compiler import WARNINGS, compiler

PROGRAM = """#define {P}_IMPLEMENTATION
#include "{p}.hpp"
#include <cstdio>
int main()
{{
    const double in[2] = {{60.0, 40.0}};
    double out[5], again[5];
    {p}::Surrogate one(in);
    one.step(in, out);
    {p}::Surrogate copy(one);
    one.step(in, out);
    copy.step(in, again);
    std::printf("%.17g %.17g %g\\n", out[0], again[0], {p}::Surrogate::sample_time());
}}
"""
OTHER = """#include "{p}.hpp"
double half(double R) {{ return R / static_cast<int>({p}::Surrogate::n_inputs); }}
"""
BOARD = """#ifndef ARDUINO_H
#define ARDUINO_H
#include <cstdio>
static struct {
    int left;
    void begin(long) { left = 3; }
    int available() { return left > 0; }
    float parseFloat() { left -= next ^= 1; return next ? 60.0f : 40.0f; }
    void print(double value, int digits) { std::printf("%.*f", digits, value); }
    void print(char c) { std::putchar(c); }
    void println(unsigned value) { std::printf("%u\\n", value); }
    int next;
} Serial;
#endif
"""


def built(folder, *arguments):
    done = subprocess.run([*compiler("c++"), *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("standard", ["c++98", "c++20"])
def test_one_source_file_implements_others_include_and_a_copy_goes_on_by_itself(limited, tmp_path, standard):
    surrogate = Surrogate.of(limited, outputs=["BC"])
    (file,) = EXPORTERS["cpp"].write(surrogate, tmp_path)
    p = file.details["prefix"]
    for name, text in (("main.cpp", PROGRAM), ("other.cpp", OTHER)):
        (tmp_path / name).write_text(text.format(p=p, P=p.upper()))
    flags = [one for one in WARNINGS if standard != "c++98" or one != "-pedantic"]  # <stdint.h> has long long
    built(tmp_path, f"-std={standard}", *flags, "-Werror", "main.cpp", "other.cpp", "-o", "main")
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    first, again, sample_time = map(float, done.stdout.split())
    u = np.tile([60.0, 40.0], (2, 1))
    assert first == again
    assert first == pytest.approx(surrogate.simulate(u)[1, 0], abs=1e-9)
    assert sample_time == surrogate.sample_time


def test_the_library_has_what_arduino_and_platformio_read_and_its_sketch_runs(limited, tmp_path):
    surrogate = Surrogate.of(limited, outputs=["BC"])
    (file,) = EXPORTERS["arduino"].write(surrogate, tmp_path)
    p = file.details["prefix"]
    with zipfile.ZipFile(tmp_path / file.name) as library:
        library.extractall(tmp_path)
        properties = dict(line.split("=", 1) for line in library.read(f"{p}/library.properties").decode().splitlines())
        described = json.loads(library.read(f"{p}/library.json"))
    assert {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url"} <= set(properties)
    assert (properties["includes"], described["headers"]) == (f"{p}.h", f"{p}.h")
    (tmp_path / "Arduino.h").write_text(BOARD)
    (tmp_path / "main.cpp").write_text("int main() { setup(); while (Serial.available()) loop(); }\n")
    sketch = tmp_path / p / "examples" / f"{p}_serial" / f"{p}_serial.ino"
    (tmp_path / "sketch.cpp").write_text(f'#include <Arduino.h>\n#include "{sketch}"\n#include "main.cpp"\n')
    built(tmp_path, "-I.", f"-I{p}/src", "sketch.cpp", f"{p}/src/{p}.c", "-o", "sketch")
    done = subprocess.run([tmp_path / "sketch"], capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    u = np.tile([60.0, 40.0], (3, 1))
    np.testing.assert_allclose([float(value) for value, _ in lines], surrogate.simulate(u)[:, 0], atol=1e-3)
    assert [int(flags) for _, flags in lines] == expected_flags(surrogate, u, surrogate.compute(u)).tolist()
