"""Files, records and folders of runs, and the workers that do jobs."""
