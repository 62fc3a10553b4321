"""What accuracy costs: many runs of a deck, their errors and their time in one table."""
