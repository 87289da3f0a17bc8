"""What a model's error does to a train: scenarios and the judge over them."""
