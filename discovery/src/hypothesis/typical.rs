//! Laws at a typical size, from which they are refined where a wrong trajectory hides them: those that are strong and not
//! smooth (friction, limits of a force, sag), and those with a motion of their own (the cables' mass).

use cdpr::effect::EffectSpec;

use crate::hypothesis::candidates::Situation;
use crate::hypothesis::friction;
use crate::hypothesis::limits;

/// A law: effects that belong together, with the rivals each would have.
pub(crate) type Law = Vec<(EffectSpec, Vec<EffectSpec>)>;

/// Laws at typical sizes, on each cable and on all. The mass of cables of `density` (kg/m), spread along them, shows in two
/// effects, across and along, of which one alone explains little.
pub(crate) fn laws(situation: &Situation, density: f64) -> Vec<Law> {
    let mut out: Vec<Law> = Vec::new();
    for cable in situation.cables_and_all() {
        let sag = EffectSpec::new("cable_sag", cable, &[1.5, situation.mean_tension]).ok();
        out.extend(friction::typical(cable, situation.mean_tension).map(|law| vec![law]));
        out.extend([limits::typical(cable, situation), sag].into_iter().flatten().map(|law| vec![(law, Vec::new())]));
    }
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).ok();
    let across = effect("cable_transverse_mode", &[density, 0.02, 0.0]);
    let along = effect("cable_axial_mass", &[density]);
    out.extend(across.zip(along).map(|(across, along)| vec![(across, Vec::new()), (along, Vec::new())]));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;

    #[test]
    fn each_cable_and_all_have_a_friction_a_limit_and_a_sag_and_the_robot_its_cables_mass() {
        let laws = laws(&Situation::of(&[record(&[], 5.0, 1)]), 0.3);
        let on = |cable: Option<usize>| {
            let of = laws.iter().filter(|law| law.len() == 1 && law[0].0.cable == cable);
            of.map(|law| law[0].0.id.as_str()).collect::<Vec<_>>()
        };
        for cable in [None, Some(1), Some(2), Some(3), Some(4)] {
            assert_eq!(on(cable), ["winch_coulomb_friction", "winch_saturation", "cable_sag"]);
        }
        let mass = laws.last().map(|law| law.iter().map(|(effect, _)| effect.id.as_str()).collect::<Vec<_>>());
        assert_eq!(mass, Some(vec!["cable_transverse_mode", "cable_axial_mass"]));
        assert_eq!(laws.len(), 16);
    }
}
