"""The workshop: tools around the book; no chapter of the book imports them."""
