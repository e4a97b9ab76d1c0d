"""The learners: networks, experience, trainers, and the loop that trains both sides."""
