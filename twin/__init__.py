"""The rig's twin: structure, joint, bench, procedures, identification, diagnosis and views."""
