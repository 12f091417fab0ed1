//! Which wrenches the cables can exert where: wrench closure, wrench feasibility, capacity margin, maps.

use nalgebra::{Matrix3xX, Vector3};

use crate::geometry::Geometry;
use crate::inverse::distribution::{Bounds, TensionLine, nearest, structure_matrix, torque_arm};
use crate::per_cable::PerCable;

/// Smallest singular value of the structure matrix, as a share of the largest and with torques divided by the attachment
/// radius, at which the cables still span all three directions: the tensions for a wrench grow by its inverse, and no
/// anchor is known to a millionth of the robot's size.
const SPANNING: f64 = 1e-6;

/// Ratio of two tensions, and wrench in units of the larger, that count as zero.
const LEAST_BALANCE: f64 = 1e-9;

/// Wrenches that the cables must be able to exert: a box about a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequiredWrenches {
    /// Its centre `[f_x, f_y, τ]` (N, N m): the opposite of a steady disturbance.
    pub centre: [f64; 3],
    /// Half its widths (N, N m).
    pub half_width: [f64; 3],
}

/// One pose's answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feasibility {
    /// The cables clear of the platform and the platform within the anchors.
    pub reachable: bool,
    /// Any wrench can be exerted with unbounded tensions: all entries of the internal tension are positive.
    pub closure: bool,
    /// Smallest over largest entry of the internal tension: 1 where equal tensions balance, negative without closure.
    pub balance: f64,
    /// Distance (N) of the required wrenches from the border of what the bounded tensions exert, torques divided by the arm ([`torque_arm`]):
    /// positive where all are feasible.
    pub margin: f64,
}

impl Feasibility {
    /// All required wrenches can be exerted within the bounds.
    pub fn feasible(&self) -> bool {
        self.reachable && self.margin >= 0.0
    }
}

/// A facet of the available wrenches: `normal · w <= offset`, with torques divided by the arm.
fn facets(structure: &Matrix3xX<f64>, arm: f64, bounds: &Bounds) -> Vec<(Vector3<f64>, f64)> {
    let columns = PerCable::from_fn(structure.ncols(), |i| {
        Vector3::new(structure[(0, i)], structure[(1, i)], structure[(2, i)] / arm)
    });
    let mut facets = Vec::with_capacity(12);
    for i in 0..columns.len() {
        for j in i + 1..columns.len() {
            let normal = columns[i].cross(&columns[j]);
            let norm = normal.norm();
            // Parallel cables span no facet.
            if norm < 1e-12 {
                continue;
            }
            for normal in [normal / norm, -normal / norm] {
                // The farthest point in this direction: each tension at the bound that helps.
                let offset = columns
                    .iter()
                    .map(|c| {
                        let along = normal.dot(c);
                        along * if along > 0.0 { bounds.upper() } else { bounds.lower() }
                    })
                    .sum();
                facets.push((normal, offset));
            }
        }
    }
    facets
}

/// Capacity margin (N): how far inside the wrenches that tensions within `bounds` exert the required ones lie, negative
/// outside; torques are divided by the largest arm, as in [`nearest`].
///
/// The available wrenches are a zonotope whose facets are spanned by pairs of cables (Bouchard, Gosselin and Moore, J. Mech.
/// Robot. 2, 2010); the margin is that of Guay, Cardou, Cruz-Ruiz and Caro (Trans. Can. Soc. Mech. Eng. 38, 2014).
pub fn capacity_margin(geometry: &Geometry, pose: &[f64; 3], bounds: &Bounds, required: &RequiredWrenches) -> f64 {
    let structure = structure_matrix(geometry, pose);
    let arm = torque_arm(&structure);
    facets(&structure, arm, bounds)
        .iter()
        .map(|(normal, offset)| {
            let scale = [1.0, 1.0, 1.0 / arm];
            let farthest: f64 = (0..3)
                .map(|k| scale[k] * (normal[k] * required.centre[k] + normal[k].abs() * required.half_width[k]))
                .sum();
            offset - farthest
        })
        .fold(f64::INFINITY, f64::min)
}

/// Feasibility of one pose. Closure is by the signs of the null vector of `J_Mᵀ` (8) with one more cable than degrees of freedom,
/// with others by tensions that balance each other (Gouttefarde and Gosselin, IEEE Trans. Robot. 22, 2006); for the margin see [`capacity_margin`].
pub fn feasibility(geometry: &Geometry, pose: &[f64; 3], bounds: &Bounds, required: &RequiredWrenches) -> Feasibility {
    let structure = structure_matrix(geometry, pose);
    // At a singular pose a null vector is rounding, whatever its signs.
    let balance = if spans(&structure, geometry.attachment_scale()) { balance(&structure) } else { -1.0 };
    Feasibility {
        reachable: geometry.check_pose(pose).is_ok(),
        closure: balance > LEAST_BALANCE,
        balance,
        margin: capacity_margin(geometry, pose, bounds, required),
    }
}

/// The largest ratio of the smallest to the largest tension with which the cables balance each other: with four cables that of
/// the null vector, negative where its signs differ; with others found by halving, -1 where there is none.
fn balance(structure: &Matrix3xX<f64>) -> f64 {
    if let Ok(line) = TensionLine::of(structure, &[0.0; 3]) {
        let least = line.internal.iter().copied().fold(f64::INFINITY, f64::min);
        return least / line.internal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }
    balance_by_halving(structure)
}

/// The same with any number of cables.
pub(super) fn balance_by_halving(structure: &Matrix3xX<f64>) -> f64 {
    let balanced = |ratio: f64| {
        Bounds::new(ratio, 1.0).is_ok_and(|bounds| {
            let found = nearest(structure, &[0.0; 3], &bounds);
            let arm = torque_arm(structure);
            let [x, y, torque] = found.shortfall;
            x.abs().max(y.abs()).max(torque.abs() / arm) < LEAST_BALANCE
        })
    };
    let (mut low, mut high) = (10.0 * LEAST_BALANCE, 1.0 - LEAST_BALANCE);
    if !balanced(low) {
        return -1.0;
    }
    if balanced(high) {
        return 1.0;
    }
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if balanced(middle) { low = middle } else { high = middle }
    }
    low
}

/// Whether the cables pull in all three directions, by more than rounding.
fn spans(structure: &Matrix3xX<f64>, arm: f64) -> bool {
    let mut scaled = structure.clone();
    scaled.row_mut(2).scale_mut(1.0 / arm);
    let values = scaled.singular_values();
    structure.ncols() >= 3 && values.min() > SPANNING * values.max()
}

/// A map over positions at one orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceMap {
    /// Positions along x (m).
    pub x: Vec<f64>,
    /// Positions along y (m).
    pub y: Vec<f64>,
    /// Orientation (rad).
    pub phi: f64,
    /// Answers, row by row: `cells[j * x.len() + i]` is at `(x[i], y[j])`.
    pub cells: Vec<Feasibility>,
}

impl WorkspaceMap {
    /// Maps `points` × `points` positions over the anchors' square at orientation `phi` (rad).
    pub fn new(geometry: &Geometry, phi: f64, points: usize, bounds: &Bounds, required: &RequiredWrenches) -> Self {
        let axis = |k: usize| -> Vec<f64> {
            let (low, high) = geometry
                .anchor
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a[k]), high.max(a[k])));
            let step = (high - low) / points.max(1) as f64;
            (0..points).map(|i| low + step * (i as f64 + 0.5)).collect()
        };
        let (x, y) = (axis(0), axis(1));
        let cells = y
            .iter()
            .flat_map(|y| x.iter().map(move |x| [*x, *y, phi]))
            .map(|pose| feasibility(geometry, &pose, bounds, required))
            .collect();
        Self { x, y, phi, cells }
    }

    /// Share of the square that is feasible.
    pub fn feasible_share(&self) -> f64 {
        self.cells.iter().filter(|c| c.feasible()).count() as f64 / self.cells.len().max(1) as f64
    }

    /// Share of the square with wrench closure.
    pub fn closure_share(&self) -> f64 {
        self.cells.iter().filter(|c| c.reachable && c.closure).count() as f64 / self.cells.len().max(1) as f64
    }
}
