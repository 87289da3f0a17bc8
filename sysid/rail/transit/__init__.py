"""Transit vehicles and automatic operation."""
