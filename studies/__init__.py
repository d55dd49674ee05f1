"""The papers: their tables, recomputed, and their own ways of identification, kept to compare with."""
