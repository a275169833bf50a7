"""What was handed in becomes a workspace in which its node can run."""
