"""The joint's linear stiffness is far from what was believed: another torque, another surface."""
