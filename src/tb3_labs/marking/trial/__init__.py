"""One prepared node in a trial: what was done to it, what it did, and the bag of both."""
