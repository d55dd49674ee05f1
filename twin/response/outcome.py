"""How an iteration ended, as numbers that a compiled function can return, and in words."""

FOUND, ENDED, FAR, LONG, NOT_FINITE, STALLED = range(6)
WORDS = {
    FAR: "Newton does not contract from where it started",
    LONG: "it takes too many steps",
    NOT_FINITE: "the equations are singular or not finite",
    STALLED: "no step along the branch is small enough",
}
"""Of what went wrong."""
