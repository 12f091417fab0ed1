//! What can be measured.

use cdpr::signal::Signal;

/// A measured quantity. Cables count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// `x`, `y` (m), `phi` (rad): 0, 1, 2.
    Pose(usize),
    /// `cable_length[i]` (m).
    CableLength(usize),
    /// `unstretched_length[i]` (m).
    UnstretchedLength(usize),
    /// `tension[i]` (N).
    Tension(usize),
}

impl Channel {
    /// Every channel that can be measured of a robot with so many cables.
    pub fn all(cables: usize) -> Vec<Self> {
        let mut all: Vec<Self> = (0..3).map(Self::Pose).collect();
        for of_cable in [Self::CableLength, Self::UnstretchedLength, Self::Tension] {
            all.extend((0..cables).map(of_cable));
        }
        all
    }

    /// The robot's signal that it is.
    pub fn signal(self) -> Signal {
        match self {
            Self::Pose(k) => Signal::Pose(k),
            Self::CableLength(i) => Signal::CableLength(i),
            Self::UnstretchedLength(i) => Signal::UnstretchedLength(i),
            Self::Tension(i) => Signal::Tension(i),
        }
    }

    /// The FMU's name of it.
    pub fn name(self) -> String {
        self.signal().name()
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        self.signal().unit()
    }

    /// The unit in which its errors are told, and how many of that one of its unit is.
    pub(crate) fn small_unit(self) -> (f64, &'static str) {
        match self {
            Self::Pose(2) => (1e3, "mrad"),
            Self::Tension(_) => (1.0, "N"),
            Self::Pose(_) | Self::CableLength(_) | Self::UnstretchedLength(_) => (1e3, "mm"),
        }
    }

    /// Smallest noise assumed (in its unit), so that data without noise do not make the filter singular.
    pub(crate) fn noise_floor(self) -> f64 {
        match self {
            Self::Pose(2) => 1e-8,
            Self::Tension(_) => 1e-2,
            Self::Pose(_) | Self::CableLength(_) | Self::UnstretchedLength(_) => 1e-6,
        }
    }
}
