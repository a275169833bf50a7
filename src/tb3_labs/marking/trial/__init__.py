"""How does a node behave in a trial? Stimuli by the marker, the node's process, and the bag."""
