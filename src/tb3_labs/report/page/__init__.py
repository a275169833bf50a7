"""How is a run shown? Writes a page with timeline, figures and tables, and other files."""
