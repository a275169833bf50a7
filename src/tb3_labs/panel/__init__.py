"""What does a page in a browser see, and what may it ask for? All that the node `panel` decides.

The messages between a page and the node are listed in :mod:`tb3_labs.panel.requests` (from the
page) and :mod:`tb3_labs.panel.picture` (to the page). How the cores are used is described in
:mod:`tb3_labs.nodes`.
"""
