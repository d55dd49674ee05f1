"""The causes a diagnosis may blame, one a file; a new one is registered by its line here."""

from twin.diagnose.cause import Cause
from twin.diagnose.causes.ac_coupling import AcCoupling
from twin.diagnose.causes.added_mass import AddedMass
from twin.diagnose.causes.air_drag import AirDrag
from twin.diagnose.causes.attached_resonator import AttachedResonator
from twin.diagnose.causes.base_motion import BaseMotion
from twin.diagnose.causes.beam_modulus import BeamModulus
from twin.diagnose.causes.channel_delay import ChannelDelay
from twin.diagnose.causes.channel_gain import ChannelGain
from twin.diagnose.causes.channel_polarity import ChannelPolarity
from twin.diagnose.causes.clamp_compliance import ClampCompliance
from twin.diagnose.causes.cross_talk import CrossTalk
from twin.diagnose.causes.cubic_stiffness import CubicStiffness
from twin.diagnose.causes.drive_mass import DriveMass
from twin.diagnose.causes.drive_position import DrivePosition
from twin.diagnose.causes.ground_friction import GroundFriction
from twin.diagnose.causes.ground_stop import GroundStop
from twin.diagnose.causes.joint_friction import JointFriction
from twin.diagnose.causes.joint_slap import JointSlap
from twin.diagnose.causes.joint_stiffness import JointStiffness
from twin.diagnose.causes.joint_uneven import JointUneven
from twin.diagnose.causes.mounting_resonance import MountingResonance
from twin.diagnose.causes.preload_loss import PreloadLoss
from twin.diagnose.causes.sample_clock import SampleClock
from twin.diagnose.causes.sensor_position import SensorPosition
from twin.diagnose.causes.stiffness_loss import StiffnessLoss
from twin.diagnose.causes.stinger_stiffness import StingerStiffness
from twin.diagnose.causes.temperature_drift import TemperatureDrift
from twin.diagnose.causes.transverse_shear import TransverseShear
from twin.diagnose.causes.viscous_damper import ViscousDamper

__all__ = ["CAUSES", "DRIFTS"]

CAUSES: dict[str, Cause] = {
    cause.name: cause
    for cause in (
        AddedMass(),
        BeamModulus(),
        ClampCompliance(),
        TransverseShear(),
        StiffnessLoss(),
        AttachedResonator(),
        CubicStiffness(),
        GroundFriction(),
        GroundStop(),
        ViscousDamper(),
        AirDrag(),
        JointStiffness(),
        JointSlap(),
        JointFriction(),
        JointUneven(),
        PreloadLoss(),
        DriveMass(),
        StingerStiffness(),
        DrivePosition(),
        SensorPosition(),
        BaseMotion(),
        TemperatureDrift(),
        ChannelGain(),
        ChannelDelay(),
        ChannelPolarity(),
        AcCoupling(),
        MountingResonance(),
        CrossTalk(),
        SampleClock(),
    )
}
"""By name."""

DRIFTS = (PreloadLoss.name, TemperatureDrift.name)
"""Causes whose rate is per second of the rig's time, which a recording without its waits does not have."""
