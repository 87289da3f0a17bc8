"""What is optional: which package belongs to which of our extras, and what is said where one is missing.

The extras stand in ``pyproject.toml``. An optional package is imported where it is used, after :func:`need`.
"""

from __future__ import annotations

import importlib.util

from sysid.errors import MissingExtraError

EXTRAS = {
    "torch": "torch",
    "onnx": "onnx",
    "onnxruntime": "onnx",
    "mlflow": "mlflow",
    "control": "control",
    "optuna": "sweep",
    "pandas": "frames",
    "pyarrow": "parquet",
    "h5py": "hdf5",
    "matio": "matlab",
    "asammdf": "mdf",
    "nptdms": "tdms",
    "openpyxl": "excel",
    "xlrd": "excel",
    "sklearn": "sklearn",
    "distributed": "dask",
    "psycopg": "postgres",
    "ziglang": "fmu-cross",
    "casadi": "casadi",
    "wasmtime": "wasm",
    "fmpy": "fmu",
    "jax": "jax",
}
"""Our extra by the name that is imported."""


def has(package: str) -> bool:
    """Whether a package is installed; it is not imported.

    Args:
        package: The name that is imported.

    Returns:
        True if it is there.

    Example:
        >>> has("numpy"), has("no_such_package")
        (True, False)
    """
    return importlib.util.find_spec(package) is not None


def need(package: str, purpose: str) -> None:
    """Refuse to go on without an optional package.

    Args:
        package: The name that is imported.
        purpose: What it is needed for.

    Raises:
        MissingExtraError: If it is not installed; its remedy is the command that installs it.

    Example:
        >>> need("onnx", "the format onnx")
    """
    if not has(package):
        raise MissingExtraError(package, EXTRAS[package], purpose)
