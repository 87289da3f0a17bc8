"""What files hold as values within values: leaves, the forms that records take in them, and the records."""
