"""What did a recorded run show? From a bag to arrays, drives, turns, tables, figures and a page."""
