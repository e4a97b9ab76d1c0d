"""What helps learning, beside the paper: other frames and other heads."""
