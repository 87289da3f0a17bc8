"""Surrogates as ONNX graphs: one step, or a run over a sequence."""
