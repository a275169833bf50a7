"""How can the node of a submission run here? This package makes a workspace for the node."""
