"""What was recorded of one run? A bag becomes a RunData, within a budget of bytes and messages."""
