"""Tries a student's node out on the embedded robot."""
