"""What is kept: files, records, run folders; and the workers that make it."""
