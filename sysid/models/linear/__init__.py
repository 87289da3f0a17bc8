"""Linear models: ARX, polynomial models, transfer functions, state spaces."""
