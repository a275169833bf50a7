"""What does a bag file hold? Its bytes become a RunData, within a budget of bytes and messages."""
