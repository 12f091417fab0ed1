//! MoorDyn 2.7.2 (<https://moordyn.readthedocs.io>): a cable of lumped masses that hangs still between two points of one height.
//!
//! Span 900 m, EA = 15.2 MN, 2.109 N/m, no bending stiffness, next to no buoyancy. Its cable is released and damped until it
//! hangs still; the horizontal force at its end is taken with 20 and with 40 segments. What a chain of `n` masses lacks of the
//! curve falls with `1/n²`, as its values with 10 segments show too, so `(4 F₄₀ - F₂₀)/3` is the curve's force. It is as exact as
//! the cable is still: some 1e-6 where it is tight, 1e-4 where it sags by 211 m.

use cdpr::effect::EffectSpec;
use cdpr::parameters::Parameters;
use cdpr::plant::Plant;

const SPAN: f64 = 900.0;
const WEIGHT: f64 = 2.109;

struct Case {
    length: f64,
    /// With 10, 20 and 40 segments.
    moordyn_force: [f64; 3],
    within: f64,
}

/// Weight over tension, w L/T, of 0.1, 0.5, 1 and 2.
const CASES: [Case; 4] = [
    Case {
        length: 899.2522592498105,
        moordyn_force: [18927.24801458491, 18955.74612511038, 18962.844680560906],
        within: 3e-6,
    },
    Case {
        length: 908.9824841650507,
        moordyn_force: [3815.7821772139023, 3829.5155145640297, 3832.9366489195095],
        within: 1e-5,
    },
    Case {
        length: 935.0130763899383,
        moordyn_force: [1963.2943076342674, 1969.7739867988892, 1971.3730663605336],
        within: 4e-5,
    },
    Case {
        length: 1021.0513301482297,
        moordyn_force: [1073.0497154920752, 1075.7398794153335, 1076.4165461624225],
        within: 1e-4,
    },
];

fn limit(coarse: f64, fine: f64) -> f64 {
    (4.0 * fine - coarse) / 3.0
}

#[test]
fn a_hanging_cable_is_the_limit_of_fine_chains() {
    let catenary = EffectSpec::new("cable_catenary", None, &[WEIGHT]).unwrap();
    let plant = Plant::new(Parameters::default(), vec![catenary]).unwrap();
    for Case { length, moordyn_force: [ten, twenty, forty], within } in CASES {
        // The chain's force converges as it is said to.
        let order = ((twenty - ten) / (forty - twenty)).log2();
        assert!((order - 2.0).abs() < 0.1, "{length} m: order {order}");
        let expected = limit(twenty, forty);
        let found = plant.tension_for(0, 0.0, SPAN, length, &[]);
        assert!((found - expected).abs() < within * expected, "{length} m: {found} against {expected}");
        // Ten segments are a hundred times farther off than the limit: what is compared is the curve, not a chain.
        assert!((ten - expected).abs() > 10.0 * within * expected);
    }
}

/// The parabola of `cable_sag` is as exact only where the cable is tight.
#[test]
fn the_parabola_is_off_where_the_cable_sags() {
    let sag = EffectSpec::new("cable_sag", None, &[WEIGHT, 1e9]).unwrap();
    let plant = Plant::new(Parameters::default(), vec![sag]).unwrap();
    let off = |case: &Case| {
        let expected = limit(case.moordyn_force[1], case.moordyn_force[2]);
        (plant.tension_for(0, 0.0, SPAN, case.length, &[]) / expected - 1.0).abs()
    };
    let [tight, .., slack] = &CASES;
    assert!(off(tight) < 1e-3, "{}", off(tight));
    assert!(off(slack) > 0.02, "{}", off(slack));
}
