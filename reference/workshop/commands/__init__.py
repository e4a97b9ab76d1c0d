"""The commands, one after another: what each is asked, does and says."""
