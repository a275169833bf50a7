"""What a node does inside: its variables, what each of them follows, and its first broken link."""
