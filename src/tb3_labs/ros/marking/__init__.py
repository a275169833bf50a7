"""How is a student's node tried out on the embedded robot? One file for each lab."""
