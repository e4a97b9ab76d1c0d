"""What helps learning, beside the paper: the robots' frame, anchors and heads."""
