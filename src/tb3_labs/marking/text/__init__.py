"""What the text of a submission shows without a trial, read in processes with limits."""
