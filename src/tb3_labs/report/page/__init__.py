"""How is it shown? The page of a run: timeline, figures, tables; and its files."""
