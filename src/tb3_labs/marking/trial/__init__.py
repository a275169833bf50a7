"""How does a node behave in a trial? The marker gives stimuli to a node and records a bag."""
