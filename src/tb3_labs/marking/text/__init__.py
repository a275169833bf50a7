"""What the marker reads in the text of a submission, in processes with limits."""
