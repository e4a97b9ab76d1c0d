"""What helps learning, beside the paper: other frames, other heads, other credit."""
