"""The run report: from a recorded run to figures and numbers."""
