"""How files of some formats begin: what tells them is asked for before what reads them is imported."""

from __future__ import annotations

LABVIEW = "LabVIEW Measurement"
NETCDF_3 = b"CDF"
ZIP = b"PK\x03\x04"
MDF_MARKS = (b"MDF     ", b"UnFinMF ")
"""How an MDF file begins, one that was closed and one that was not."""
