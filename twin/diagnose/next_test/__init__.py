"""The measurement that would tell rival causes apart, for the least time on the rig."""

from twin.diagnose.next_test.plan import plan_next_test
