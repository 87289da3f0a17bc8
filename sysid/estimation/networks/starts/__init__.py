"""Random starts of one network: what they have in common, their race, and the choice among them."""
