"""The commands: the options, work and output of each."""
