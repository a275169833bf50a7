"""What does a bag file hold? From its bytes to a RunData, within a budget of bytes and messages."""
