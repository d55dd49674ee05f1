"""What is promised: speed beside something else that gives the same answer, and faults that must be noticed."""
