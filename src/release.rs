//! A release of the platform with known answers, to check any way of running the plant against.

/// One instant of [`RELEASE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReleaseRow {
    /// Time (s).
    pub time: f64,
    /// Pose `[x, y, φ]` (m, rad).
    pub pose: [f64; 3],
    /// Unstretched lengths (m).
    pub unstretched_length: [f64; 4],
    /// Tensions (N).
    pub tension: [f64; 4],
}

/// Start pose of [`RELEASE`] (m, rad).
pub const RELEASE_POSE: [f64; 3] = [0.1; 3];

/// The platform of Tables I and II (`A = 4e-4 m²`, lumped masses) released at rest from [`RELEASE_POSE`], every winch
/// pulling with 1000 N and every spring carrying that at the start.
///
/// Computed with an independent Dormand-Prince 8(5,3) integrator at relative and absolute tolerance 1e-12, checked
/// against a Runge-Kutta method of order 4 at steps of 1 ms to 1e-10; printed to 10 digits.
pub const RELEASE: [ReleaseRow; 6] = [
    ReleaseRow {
        time: 0.0,
        pose: [0.1, 0.1, 0.1],
        unstretched_length: [901.1354009, 898.9960286, 900.852594, 898.9991587],
        tension: [1000.0, 1000.0, 1000.0, 1000.0],
    },
    ReleaseRow {
        time: 1.0,
        pose: [0.09996146395, 0.09995968337, 0.1000568557],
        unstretched_length: [901.1359055, 898.9954669, 900.8532093, 898.9985983],
        tension: [1000.081074, 999.90959, 1000.094669, 999.9095578],
    },
    ReleaseRow {
        time: 5.0,
        pose: [0.09903854427, 0.09899415739, 0.1014233341],
        unstretched_length: [901.1481507, 898.9818407, 900.8681242, 898.9850023],
        tension: [1000.055707, 999.9428216, 1000.068239, 999.9432948],
    },
    ReleaseRow {
        time: 10.0,
        pose: [0.09617267687, 0.09599688657, 0.1057332615],
        unstretched_length: [901.1868182, 898.9388839, 900.9150799, 898.9421384],
        tension: [1000.086979, 999.9020214, 1000.10683, 999.9028128],
    },
    ReleaseRow {
        time: 20.0,
        pose: [0.08498329362, 0.08430780395, 0.1235809352],
        unstretched_length: [901.3476993, 898.7612063, 901.1083041, 898.7648046],
        tension: [1000.125725, 999.8635548, 1000.145636, 999.8638785],
    },
    ReleaseRow {
        time: 50.0,
        pose: [0.01818326125, 0.01506077759, 0.2778655904],
        unstretched_length: [902.758377, 897.2470203, 902.7113214, 897.2519394],
        tension: [1000.260172, 999.7379766, 1000.263891, 999.737674],
    },
];
