"""What was recorded during one run? A bag becomes a RunData, and the memory for it is limited."""
