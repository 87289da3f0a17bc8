"""What the TorchScript files contain, and the modules they are made from."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile

import numpy as np
import torch

from sysid.export import EXPORTERS, StateLayout
from sysid.export.torch.module import SurrogateSequence
from sysid.models import NARX


def test_archive_tells_nothing_about_the_machine_that_wrote_it(narx, declared, tmp_path):
    surrogate = declared(narx(NARX(input_delays=1, output_delays=1, neurons=1)))
    for file in EXPORTERS["torchscript"].write(surrogate, tmp_path):
        with zipfile.ZipFile(tmp_path / file.name) as archive:
            assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
            assert not [entry.filename for entry in archive.infolist() if "debug" in entry.filename]
            assert not [name for name in archive.namelist() if __file__.encode()[:10] in archive.read(name)]


def test_what_was_exported_before_in_the_process_leaves_no_trace_in_the_archive(narx, circle, tmp_path):
    """In processes of their own, since this one has exported before."""
    model = narx(NARX(input_delays=1, output_delays=1, neurons=1))
    script = (
        "import json, pathlib, sys; from sysid.export import EXPORTERS, Surrogate\n"
        "from sysid.models import cascade_from_dict, model_from_dict\n"
        "model, others = json.loads(pathlib.Path(sys.argv[1]).read_text())\n"
        "sources = [cascade_from_dict(one) for one in others] + [model_from_dict(model)]\n"
        "for one in sources: EXPORTERS['torchscript'].write(Surrogate.of(one), pathlib.Path(sys.argv[2]))"
    )
    written = []
    for name, others in (("alone", []), ("after another", [circle.source.to_dict()])):
        folder = tmp_path / name
        folder.mkdir()
        sources = tmp_path / f"{name}.json"
        sources.write_text(json.dumps([model.to_dict(), others]), encoding="utf-8")
        subprocess.run([sys.executable, "-c", script, sources, folder], check=True)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]


def test_exported_program_tells_nothing_about_the_machine_that_wrote_it(narx, declared, tmp_path):
    surrogate = declared(narx(NARX(input_delays=1, output_delays=1, neurons=1)))
    (file,) = EXPORTERS["torch-export"].write(surrogate, tmp_path)
    with zipfile.ZipFile(tmp_path / file.name) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert not [name for name in archive.namelist() if __file__.encode()[:10] in archive.read(name)]


def test_module_keeps_derivatives(narx, declared, inputs, past):
    model = narx(NARX(input_delays=2, output_delays=2, neurons=3))
    module = SurrogateSequence(declared(model))
    u = torch.tensor(inputs(6, 2)[:, np.newaxis])
    state = torch.tensor(StateLayout.of(model).from_history(past(model))[np.newaxis], requires_grad=True)
    assert torch.autograd.gradcheck(lambda start: module(u, start)[0], (state,))


def test_number_type_can_be_chosen(narx, declared):
    model = narx(NARX(input_delays=2, output_delays=2, neurons=3))
    module = SurrogateSequence(declared(model), dtype=torch.float32)
    y, state, _ = module(torch.zeros(3, 1, 2, dtype=torch.float32), torch.zeros(1, 6, dtype=torch.float32))
    assert (y.dtype, state.dtype) == (torch.float32, torch.float32)
