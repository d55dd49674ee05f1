"""The papers: their printed tables, and this project's numbers beside them."""
