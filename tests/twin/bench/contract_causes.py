"""Causes and their parameters as the recording contract, version 1, has them."""

CONTRACT = {
    "added-mass": {"position_m", "mass_kg"},
    "beam-modulus": {"beam", "factor"},
    "clamp-compliance": {"rotational_rad_per_Nm"},
    "transverse-shear": {"beam", "modulus_ratio"},
    "stiffness-loss": {"position_m", "factor"},
    "attached-resonator": {"position_m", "mass_kg", "frequency_Hz", "damping_ratio"},
    "cubic-stiffness": {"position_m", "stiffness_N_per_m3"},
    "ground-friction": {"position_m", "force_N"},
    "ground-stop": {"position_m", "gap_m", "stiffness_N_per_m"},
    "viscous-damper": {"position_m", "damping_Ns_per_m"},
    "air-drag": {"coefficient_Ns2_per_m3"},
    "joint-stiffness": {"normal_factor", "shear_factor"},
    "joint-slap": {"gap_m", "stiffness_factor"},
    "joint-friction": {"stiffness_N_per_m", "slip_force_N"},
    "joint-uneven": {"gradient"},
    "preload-loss": {"rate_per_s"},
    "drive-mass": {"mass_kg"},
    "stinger-stiffness": {"stiffness_N_per_m"},
    "drive-position": {"channel", "offset_m"},
    "sensor-position": {"channel", "offset_m"},
    "base-motion": {"receptance_m_per_N"},
    "temperature-drift": {"rate_per_s"},
    "channel-gain": {"channel", "factor"},
    "channel-delay": {"channel", "delay_s"},
    "channel-polarity": {"channel"},
    "clipping": {"channel", "limit"},
    "ac-coupling": {"channel", "corner_Hz"},
    "mounting-resonance": {"channel", "frequency_Hz", "damping_ratio"},
    "cross-talk": {"channel", "source", "factor"},
    "mains-hum": {"channel", "frequency_Hz", "amplitude"},
    "sample-clock": {"error_ppm"},
    "unsettled-dwell": {"sweep"},
    "lost-samples": {"channel"},
    "quantisation": {"channel", "step"},
}

BEYOND_CONTRACT = {"joint-friction": {"layer_element"}}
"""What is told beside the contract's parameters: where in the layer a slider sits."""

SEEN_IN_SAMPLES = {"clipping", "mains-hum", "unsettled-dwell", "lost-samples", "quantisation"}
"""What a look at the samples alone finds: not a forward model's to explain."""
