"""The learners: what agents observe, how they decide, and how both sides train."""
