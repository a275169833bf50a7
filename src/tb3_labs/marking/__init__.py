"""What is a student's node worth? Criteria and points of each lab, judged by what was observed."""
