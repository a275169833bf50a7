"""What does a recorded run show? A bag becomes arrays, drives and turns, and then a page."""
