"""The page of the format wasm: it runs the surrogate by sliders, whatever the channels are called."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

from sysid.export import EXPORTERS, Surrogate
from sysid.models import ARX, ARXModel, Mapping

pytestmark = pytest.mark.browser
EVIL = "</script><b onclick=alert(1)>"
RUN = """u => { surrogate.inputs.set(u[0]); surrogate.rest();
    return u.map(row => { surrogate.inputs.set(row); surrogate.step(); return Array.from(surrogate.outputs); }); }"""
NODE = """const fs = require("fs"), [path, text] = process.argv.slice(1), u = JSON.parse(text);
WebAssembly.instantiate(fs.readFileSync(path), {}).then(({instance}) => {
  const f = instance.exports, memory = f.memory.buffer;
  const x = new Float64Array(memory, f.inputs(), f.n_inputs());
  const y = new Float64Array(memory, f.outputs(), f.n_outputs());
  x.set(u[0]); f.init();
  console.log(JSON.stringify(u.map(row => { x.set(row); f.step(); return Array.from(y); })));
});"""


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """A model whose input has a name that would end a script."""
    model = ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(1,)),
        coefficients=np.array([0.3, -0.9]),
        intercept=1.0,
        mapping=Mapping(inputs=(EVIL,), output="y"),
        sample_time=0.05,
        input_units=("V",),
        output_unit="psi",
        rest_output=10.0,
    )
    return Surrogate.of(model, {EVIL: (0.0, 20.0)})


@pytest.fixture(scope="module")
def written(surrogate, tmp_path_factory):
    problem = EXPORTERS["wasm"].lacks()
    if problem:
        pytest.skip(str(problem))
    folder = tmp_path_factory.mktemp("wasm")
    (file,) = EXPORTERS["wasm"].write(surrogate, folder)
    return folder / file.name


@pytest.fixture(scope="module")
def u() -> np.ndarray:
    return np.random.default_rng(0).uniform(0.0, 20.0, (200, 1))


def test_node_runs_the_module_without_anything_of_ours(surrogate, written, u):
    import json

    if shutil.which("node") is None:
        pytest.skip("there is no node")
    done = subprocess.run(["node", "-e", NODE, written, json.dumps(u.tolist())], capture_output=True, check=True)
    np.testing.assert_allclose(json.loads(done.stdout), surrogate.simulate(u), rtol=0, atol=1e-9)


def test_the_page_runs_by_itself_and_by_its_slider(surrogate, written, u, page, picture):
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(written.with_suffix(".html").as_uri())
    page.wait_for_function("window.surrogate !== undefined")
    assert page.locator("label").inner_text() == f"{EVIL} [V]"
    found = page.evaluate(RUN, u.tolist())
    np.testing.assert_allclose(found, surrogate.simulate(u), rtol=0, atol=1e-9)
    page.get_by_role("button", name="At rest").click()
    slider = page.get_by_role("slider")
    slider.fill("20")
    assert page.get_by_role("spinbutton").input_value() == "20"
    settled = surrogate.simulate(np.full((2000, 1), 20.0))[-1, 0]
    page.wait_for_function(f"Math.abs(surrogate.outputs[0] - {settled}) < 0.05")
    page.get_by_role("spinbutton").fill("25")
    page.locator("#flags", has_text="outside").wait_for()
    picture("sliders")
    assert errors == []
