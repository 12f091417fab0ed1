//! What effects see of the plant.

use crate::geometry::Geometry;

/// What a winch-side effect sees of its cable. Lengths in m, speeds in m/s.
#[derive(Clone, Copy, Debug)]
pub struct WinchContext<S> {
    /// Time (s).
    pub time: S,
    /// Speed at which cable leaves the winch (m/s), positive when paying out: `l̇`, or `L̇` in cable models without a
    /// winch-side mass.
    pub speed: S,
}

/// What a cable's elastic law sees of its cable as its own states move on.
#[derive(Clone, Copy, Debug)]
pub struct StrainContext<S> {
    /// Tension (N), zero where the cable is slack.
    pub tension: S,
    /// Rate of the strain `(L - l)/l` (1/s), zero where the cable is slack.
    pub strain_rate: S,
}

/// What an effect that swings across its cable sees of it.
#[derive(Clone, Copy, Debug)]
pub struct SwingContext<S> {
    /// Geometric length (m).
    pub length: S,
    /// Angular rate of the chord (rad/s).
    pub angular_rate: S,
    /// Tension (N), zero where the cable is slack; the winch's pull in cable models whose tension depends on the
    /// acceleration.
    pub tension: S,
}

/// What a platform-side effect sees.
#[derive(Clone, Copy, Debug)]
pub struct PlatformContext<'a, S> {
    /// Time (s).
    pub time: S,
    /// Anchors and attachment points.
    pub geometry: &'a Geometry,
    /// `[x, y, φ]` (m, rad).
    pub pose: &'a [S; 3],
    /// `[vx, vy, φ̇]` (m/s, rad/s).
    pub twist: &'a [S; 3],
    /// Winch forces as commanded (N) and disturbances (N, N m).
    pub inputs: &'a crate::dynamics::Inputs<S>,
    /// Geometric cable lengths (m).
    pub cable_length: &'a [S],
    /// Rates of the geometric lengths (m/s).
    pub cable_speed: &'a [S],
    /// Unstretched lengths (m).
    pub unstretched_length: &'a [S],
    /// Rates of the unstretched lengths (m/s).
    pub unstretched_rate: &'a [S],
}
