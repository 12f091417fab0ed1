//! Formulas exactly as the paper prints them, kept apart from the plant: only to show what they do.
//!
//! Each has an entry in the errata; the tests beside this crate show where it goes wrong. Vectors are in the plane, `n` is
//! `K × S`.

/// (4): no square root.
pub fn length(pose: [f64; 3], radius: f64, attachment_angle: f64, anchor: [f64; 2]) -> f64 {
    let angle = pose[2] + attachment_angle;
    (pose[0] + radius * angle.cos() - anchor[0]).powi(2) + (pose[1] + radius * angle.sin() - anchor[1]).powi(2)
}

/// (7), right-hand side: velocity of the attachment point with `α̇ L̇` where `α̇ L` belongs.
pub fn attachment_velocity(s: [f64; 2], length_rate: f64, angular_rate: f64) -> [f64; 2] {
    let n = [-s[1], s[0]];
    std::array::from_fn(|k| length_rate * s[k] + angular_rate * length_rate * n[k])
}

/// (16): acceleration of the limb's centre with `α̇ L` where `α̇² L` belongs.
pub fn centre_acceleration(
    s: [f64; 2],
    [length, rate, acceleration]: [f64; 3],
    [angular_rate, angular_acceleration]: [f64; 2],
) -> [f64; 2] {
    let n = [-s[1], s[0]];
    let along = acceleration - angular_rate * length;
    let across = angular_acceleration * length + 2.0 * rate * angular_rate;
    std::array::from_fn(|k| 0.5 * (along * s[k] + across * n[k]))
}

/// (17), first form: moment of inertia of a limb from the platform's `M`.
pub fn limb_inertia(platform_mass: f64, length: f64) -> f64 {
    platform_mass * length * length / 3.0
}

/// (25): the force across the cable on the platform, with the sign of the limb's.
pub fn transverse_force(density: f64, [length, rate]: [f64; 2], [angular_rate, angular_acceleration]: [f64; 2]) -> f64 {
    density / 3.0 * (length * length * angular_acceleration + 3.0 * length * rate * angular_rate)
}

/// (24), left-hand side: `F_B^N - F_A^N`.
pub fn transverse_difference(at_platform: f64, at_anchor: f64) -> f64 {
    at_platform - at_anchor
}

/// (28): force on the platform from `F^S` along and `F^N` across a cable, components mixed up.
pub fn platform_force(along: f64, across: f64, s: [f64; 2]) -> [f64; 2] {
    [along * s[0] + across * s[1], along * s[1] + across * s[0]]
}

/// (28): moment on the platform of a force across the cable, with `E_x S_x - E_y S_y`.
pub fn transverse_moment(across: f64, arm: [f64; 2], s: [f64; 2]) -> f64 {
    across * (arm[0] * s[0] - arm[1] * s[1])
}

/// (36): elastic force with the stretched length in the denominator.
pub fn elastic_force(axial_stiffness: f64, length: f64, unstretched: f64) -> f64 {
    axial_stiffness / length * (length - unstretched)
}

/// (35): accelerations `[ẍ, ẍ']` of the body `M` and of the cable's lumped mass `m` as printed, `ẍ` in both rows.
///
/// `force` is the winch's; `k` and `b` are spring and damper between `x` and `x'`. The second row is solved for what stands
/// in it, `m ẍ`, so both accelerations are of the body: the lumped mass has no equation of its own and is given none.
pub fn two_mass([body, lumped]: [f64; 2], [k, b]: [f64; 2], [stretch, stretch_rate]: [f64; 2], force: f64) -> [f64; 2] {
    let spring = k * stretch + b * stretch_rate;
    [spring / body, (force - spring) / lumped]
}
