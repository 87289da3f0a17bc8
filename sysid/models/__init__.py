"""What a model is: structure, parameters, scaling, initial state; free run and prediction."""
