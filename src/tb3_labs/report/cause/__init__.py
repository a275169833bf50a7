"""Why did it move so? The known mistake that explains a run, and its hints."""
