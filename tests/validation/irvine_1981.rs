//! H. M. Irvine, Cable Structures (1981), chapter 2: a shallow cable of weight `w` per length over the span `L` under the
//! tension `T` is longer than its chord by `w² L³ / (24 T²)`.

use cdpr::effect::EffectSpec;
use cdpr::parameters::Parameters;
use cdpr::plant::Plant;

#[test]
fn sag_takes_up_the_length_of_the_parabola() {
    let (weight, length) = (2.11_f64, 900.0);
    // Against a reference so tight that it does not sag.
    let sag = EffectSpec::new("cable_sag", None, &[weight, 1e9]).unwrap();
    let plant = Plant::new(Parameters::default(), vec![sag]).unwrap();
    let straight = Plant::new(Parameters::default(), Vec::new()).unwrap();
    for tension in [5e3_f64, 10e3, 20e3] {
        let free = |plant: &Plant| plant.unstretched_length_for(0, 0.0, length, tension, &[0.0; 6]);
        let longer = free(&plant) - free(&straight);
        let parabola = weight.powi(2) * length.powi(3) / (24.0 * tension.powi(2));
        // The parabola's length by quadrature of sqrt(1 + y'²), y' = w (L/2 - s)/T.
        let pieces = 10_000;
        let arc: f64 = (0..pieces)
            .map(|k| {
                let s = length * (f64::from(k) + 0.5) / f64::from(pieces);
                (1.0 + (weight * (0.5 * length - s) / tension).powi(2)).sqrt() * length / f64::from(pieces)
            })
            .sum();
        assert!((arc - length - parabola).abs() < 0.01 * parabola, "{} against {parabola}", arc - length);
        assert!((longer - parabola).abs() < 0.01 * parabola, "T = {tension} N: {longer} against {parabola}");
    }
}
