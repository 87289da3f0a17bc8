"""What every model can do, and what it lowers to: the form that is run and exported."""
