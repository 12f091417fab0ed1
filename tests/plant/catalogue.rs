//! Every effect of the catalogue with parameters by chance, for tests that must hold for all of them.

use cdpr::effect::{CATALOGUE, EffectSpec, Scope};

use crate::random::Random;

/// Terms that use every kind of variable a formula knows.
const EXPRESSIONS: [(&str, &str); 4] = [
    ("platform.force_x", "-34.8*x*abs(y) + 2*omega*sin(time)"),
    ("platform.force_y", "0.1*disturbance_force_x - 5*tanh(vx*vy) + 1e-3*cable_length[2]*cable_speed[3]"),
    ("platform.torque", "-1e3*sin(phi)*vy + disturbance_torque/7 + sqrt(abs(disturbance_force_y))"),
    ("winch[2]", "0.01*winch_force[1] + 20*unstretched_length_rate[2] + 1e-4*unstretched_length[2]^2 - 30*exp(-x^2)"),
];

/// Parameter values within the typical range of the effect `id`.
pub(crate) fn values(random: &mut Random, id: &str) -> Vec<f64> {
    let info = cdpr::effect::find(id).unwrap();
    let mut values: Vec<f64> = info.parameters.iter().map(|p| random.within(p.typical.0, p.typical.1)).collect();
    match id {
        // Not above the upper limit.
        "winch_saturation" => values[0] = values[0].min(0.5 * values[1]),
        // The plant must keep a positive mass and inertia.
        "platform_mass" => values[0] = values[0].abs(),
        _ => {}
    }
    values
}

/// One entry (or, for expressions, several) for every effect; effects on cables on all of them or on one.
pub(crate) fn everything(random: &mut Random) -> Vec<EffectSpec> {
    let mut all = Vec::new();
    for info in CATALOGUE {
        if info.id == "expression" {
            all.extend(EXPRESSIONS.iter().map(|(target, text)| EffectSpec::expression(target, text).unwrap()));
            continue;
        }
        let cable = match info.scope {
            Scope::Whole => None,
            Scope::EachCable => [None, Some(1), Some(2), Some(3), Some(4)][random.within(0.0, 4.99) as usize],
        };
        all.push(EffectSpec::new(info.id, cable, &values(random, info.id)).unwrap());
    }
    all
}
