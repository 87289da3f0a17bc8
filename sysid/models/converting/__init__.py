"""Linear systems in other forms: sampled, continuous, smaller, canonical, as objects of python-control."""
