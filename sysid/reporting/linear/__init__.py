"""What linear models answer: responses, poles and their intervals."""
