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
    pub(super) const ALL: [Self; 4] = [Self::Pose, Self::CableLengths, Self::UnstretchedLengths, Self::Tensions];

    pub(crate) fn of(channel: Channel) -> Self {
        match channel {
            Channel::Pose(_) => Self::Pose,
            Channel::CableLength(_) => Self::CableLengths,
            Channel::UnstretchedLength(_) => Self::UnstretchedLengths,
            Channel::Tension(_) => Self::Tensions,
        }
    }
}
