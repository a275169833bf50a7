"""How many points is a student's node worth? A trial is recorded, and criteria judge the trial."""
