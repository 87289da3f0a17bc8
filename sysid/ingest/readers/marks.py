"""How files of some formats begin: what tells them is asked for before what reads them is imported."""

from __future__ import annotations

LABVIEW = "LabVIEW Measurement"
NETCDF_3 = b"CDF"
ZIP = b"PK\x03\x04"
