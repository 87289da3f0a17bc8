"""Linear models: ARX, transfer functions, instrumental variables, order search."""
