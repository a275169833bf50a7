"""How many points is a student's node worth? The node is tried, and criteria judge the trial."""
