"""The paper beside the code: one page, and the index that pytest reads.

Read `words` (what the page says of itself), `index` (where code and tests carry the
paper), then `page`.
"""
