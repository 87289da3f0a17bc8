"""Members that are declared and not fitted, and the expressions that they and limits are made of."""
