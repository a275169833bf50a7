"""How can a stranger's node run on this machine? A submission is copied into a workspace."""
