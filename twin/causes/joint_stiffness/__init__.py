"""The joint's linear stiffness is far from what was assumed: another torque, another surface."""
