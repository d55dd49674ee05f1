"""Something loose that resonates by itself: a cable, a bracket, a dangling connector."""
