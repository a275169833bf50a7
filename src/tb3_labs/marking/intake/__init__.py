"""A submission becomes a workspace in which its node can run."""
