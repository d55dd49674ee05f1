"""Speed: what is promised, measured on this machine beside something else that gives the same answer."""
