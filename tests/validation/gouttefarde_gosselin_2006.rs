//! M. Gouttefarde, C. M. Gosselin, Analysis of the wrench-closure workspace of planar parallel cable-driven mechanisms, IEEE
//! Trans. Robot. 22 (2006): at one orientation of a platform on four cables, the workspace's border consists of conics, one
//! for each three of the cables: where these three no longer span all wrenches.

use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, structure_matrix};
use cdpr::kinematics;
use cdpr::parameters::{CableParameters, Parameters};
use cdpr::statics::workspace::{RequiredWrenches, feasibility};
use nalgebra::{Matrix3, Matrix6, Vector6};

/// Three cables' structure matrix with columns as long as the cables, all cables but `left_out`.
fn minor(geometry: &Geometry, pose: &[f64; 3], left_out: usize) -> f64 {
    let structure = structure_matrix(geometry, pose);
    let length = kinematics::cable_lengths(geometry, pose);
    let columns: Vec<_> = (0..4).filter(|i| *i != left_out).map(|i| structure.column(i) * length[i]).collect();
    Matrix3::from_columns(&columns).determinant()
}

fn terms(x: f64, y: f64) -> Vector6<f64> {
    Vector6::new(1.0, x, y, x * x, x * y, y * y)
}

/// The conic through what `minor` is at six positions.
fn conic(geometry: &Geometry, phi: f64, left_out: usize) -> Vector6<f64> {
    let places = [[0.5, 0.4], [3.1, 0.7], [2.2, 2.6], [0.9, 1.9], [1.7, 1.1], [2.9, 1.6]];
    let rows = places.map(|[x, y]| terms(x, y).transpose());
    let values = Vector6::from_fn(|k, _| minor(geometry, &[places[k][0], places[k][1], phi], left_out));
    Matrix6::from_rows(&rows).lu().solve(&values).unwrap()
}

#[test]
fn four_conics_bound_the_wrench_closure_workspace() {
    let ends =
        [([0.0, 0.0], [0.2, -0.1]), ([4.0, 0.1], [-0.15, -0.2]), ([3.8, 3.0], [-0.2, 0.15]), ([0.3, 3.2], [0.1, 0.2])];
    let cable = ends.map(|(anchor, attachment)| CableParameters::between(anchor, attachment)).to_vec();
    let geometry = Geometry::new(&Parameters { cable, ..Parameters::default() });
    let (bounds, none) =
        (Bounds::new(1.0, 100.0).unwrap(), RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] });
    for phi in [-0.4, 0.0, 0.25, 0.8] {
        let conics: Vec<_> = (0..4).map(|i| conic(&geometry, phi, i)).collect();
        let (mut closed, mut open) = (0, 0);
        for k in 0..900 {
            let (x, y) = (0.15 + 0.125 * f64::from(k % 30), 0.1 + 0.1 * f64::from(k / 30));
            let pose = [x, y, phi];
            let values: Vec<f64> = conics.iter().map(|c| c.dot(&terms(x, y))).collect();
            for (i, value) in values.iter().enumerate() {
                let found = minor(&geometry, &pose, i);
                assert!((value - found).abs() < 1e-10, "{pose:?}, without cable {}: {value} {found}", i + 1);
            }
            // The null vector's entries are the minors with alternating signs.
            let signs = [values[0], -values[1], values[2], -values[3]];
            let expected = signs.iter().all(|v| *v > 0.0) || signs.iter().all(|v| *v < 0.0);
            assert_eq!(feasibility(&geometry, &pose, &bounds, &none).closure, expected, "{pose:?} {signs:?}");
            if expected { closed += 1 } else { open += 1 }
        }
        assert!(closed > 20 && open > 20, "{phi}: {closed} closed, {open} open");
    }
}

/// Whether the null vector of four cables' minors has one sign: none of them zero, alternating.
fn four_close(geometry: &Geometry, pose: &[f64; 3], cables: [usize; 4]) -> bool {
    let structure = structure_matrix(geometry, pose);
    let minors = [0, 1, 2, 3].map(|left_out| {
        let kept: Vec<_> = (0..4).filter(|i| *i != left_out).map(|i| structure.column(cables[i])).collect();
        [1.0, -1.0][left_out % 2] * Matrix3::from_columns(&kept).determinant()
    });
    minors.iter().all(|m| *m > 0.0) || minors.iter().all(|m| *m < 0.0)
}

/// Carathéodory (1911): where directions in three dimensions surround the origin, some four of them do, unless three lie in a
/// plane with it. So the workspace of six or eight cables is what those of four make together.
#[test]
fn more_cables_close_where_some_four_of_them_do() {
    let bounds = Bounds::new(1.0, 100.0).unwrap();
    let none = RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    for cables in [6, 8] {
        let cable: Vec<_> = (0..cables)
            .map(|i| {
                let (s, far) = (i as f64, [3.0, 2.2][i % 2]);
                let angle = std::f64::consts::TAU * (s + 0.3 * (1.7 * s).sin()) / f64::from(cables as u32);
                let end = angle + 1.1 * (2.3 * s).cos();
                let anchor = [far * angle.cos(), far * angle.sin()];
                CableParameters::between(anchor, [0.25 * end.cos(), 0.25 * end.sin()])
            })
            .collect();
        let geometry = Geometry::new(&Parameters { cable, ..Parameters::default() });
        let (mut closed, mut open) = (0, 0);
        for k in 0..1200 {
            let (i, j) = (f64::from(k % 20), f64::from(k / 20 % 20));
            let pose = [0.23 * (i - 9.4), 0.23 * (j - 9.6), [-0.9, 0.1, 0.8][k as usize / 400]];
            let some_four = (0..cables)
                .any(|a| (0..a).any(|b| (0..b).any(|c| (0..c).any(|d| four_close(&geometry, &pose, [a, b, c, d])))));
            let found = feasibility(&geometry, &pose, &bounds, &none);
            assert_eq!(found.closure, some_four, "{cables} cables at {pose:?}: balance {}", found.balance);
            if some_four { closed += 1 } else { open += 1 }
        }
        assert!(closed > 100 && open > 100, "{cables} cables: {closed} closed, {open} open");
    }
}
