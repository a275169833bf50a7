"""How is a run shown? The page with timeline, figures and tables, and the files beside it."""
