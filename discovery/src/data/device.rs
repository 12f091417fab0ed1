//! Devices, and the channels that are theirs.

use crate::data::Channel;

/// Channels that share a device and its clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Device {
    Pose,
    CableLengths,
    UnstretchedLengths,
    Tensions,
}

impl Device {
    pub(crate) const ALL: [Self; 4] = [Self::Pose, Self::CableLengths, Self::UnstretchedLengths, Self::Tensions];

    pub(crate) fn of(channel: Channel) -> Self {
        match channel {
            Channel::Pose(_) => Self::Pose,
            Channel::CableLength(_) => Self::CableLengths,
            Channel::UnstretchedLength(_) => Self::UnstretchedLengths,
            Channel::Tension(_) => Self::Tensions,
        }
    }

    /// What it is called.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::CableLengths => "cable_length",
            Self::UnstretchedLengths => "unstretched_length",
            Self::Tensions => "tension",
        }
    }
}
