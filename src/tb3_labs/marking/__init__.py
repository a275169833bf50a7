"""How many points is a student's node worth? Trials of a node, and the criteria of each lab."""
