"""What does each node decide? One file for each node of `scripts/` that decides something, named
as the node, and the devices that only one of them reads.

Samples and events go in with the time of their arrival; `command(now)` says what to send.
"""
