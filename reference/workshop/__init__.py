"""The workshop: what makes the book practical; no chapter of it imports this."""
