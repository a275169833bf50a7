"""What was recorded of one run? A bag becomes a RunData, and the memory for it is limited."""
