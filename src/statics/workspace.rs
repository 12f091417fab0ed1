//! Which wrenches the cables can exert where: wrench closure, wrench feasibility, capacity margin, maps.

use nalgebra::{Matrix3xX, Vector3};

use crate::geometry::Geometry;
use crate::inverse::distribution::{Bounds, TensionLine, nearest, structure_matrix, torque_arm};

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

    /// Any wrench can be exerted, at a pose that the platform can take.
    pub fn closed(&self) -> bool {
        self.reachable && self.closure
    }
}

/// Directions across the facets of what the columns span by tensions of their own: a zonotope, which lies flat where they span
/// a plane or a line only.
fn facet_normals(columns: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let factors = Matrix3xX::from_columns(columns).svd(true, false);
    let Some(u) = factors.u else { return Vec::new() };
    let across = |k: usize| Vector3::from(u.column(k));
    let values = &factors.singular_values;
    // Two cables have two singular values.
    let rank = values.iter().filter(|value| **value > SPANNING * values.max()).count();
    match rank {
        3.. => {
            let pairs = (0..columns.len()).flat_map(|i| (i + 1..columns.len()).map(move |j| (i, j)));
            pairs.filter_map(|(i, j)| columns[i].cross(&columns[j]).try_normalize(1e-12)).collect()
        }
        2 => {
            let flat = across(0).cross(&across(1));
            let edges = columns.iter().filter_map(|column| flat.cross(column).try_normalize(1e-12));
            std::iter::once(flat).chain(edges).collect()
        }
        _ => {
            let along = across(0);
            let beside = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
            vec![along, beside, along.cross(&beside)]
        }
    }
}

/// The facets of the available wrenches as `normal · w <= offset`, with torques divided by the arm.
fn facets(structure: &Matrix3xX<f64>, arm: f64, bounds: &Bounds) -> Vec<(Vector3<f64>, f64)> {
    let columns: Vec<_> = structure.column_iter().map(|c| Vector3::new(c[0], c[1], c[2] / arm)).collect();
    let offset = |normal: &Vector3<f64>| {
        // The farthest point in this direction: each tension at the bound that helps.
        let farthest = |c: &Vector3<f64>| {
            let along = normal.dot(c);
            along * if along > 0.0 { bounds.upper() } else { bounds.lower() }
        };
        columns.iter().map(farthest).sum()
    };
    let both = facet_normals(&columns).into_iter().flat_map(|normal| [normal, -normal]);
    both.map(|normal| (normal, offset(&normal))).collect()
}

/// Capacity margin (N): how far inside the wrenches that tensions within `bounds` exert the required ones lie, negative
/// outside; torques are divided by the largest arm, as in [`nearest`]. Where the cables do not pull in all three directions it is
/// zero at most.
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

/// Positions (m) and orientations (rad) of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPoints {
    /// Positions along x.
    pub x: Vec<f64>,
    /// Positions along y.
    pub y: Vec<f64>,
    /// Orientations.
    pub phi: Vec<f64>,
}

impl MapPoints {
    /// The middles of `points` × `points` equal cells of the area between two corners (m).
    pub fn over([low, high]: [[f64; 2]; 2], points: usize, phi: Vec<f64>) -> Self {
        let axis = |k: usize| {
            let step = (high[k] - low[k]) / points.max(1) as f64;
            (0..points).map(|i| low[k] + step * (i as f64 + 0.5)).collect()
        };
        Self { x: axis(0), y: axis(1), phi }
    }
}

/// Lower left and upper right corner (m) of the rectangle that the anchors span.
pub fn anchor_rectangle(geometry: &Geometry) -> [[f64; 2]; 2] {
    let nothing = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    geometry
        .anchor
        .iter()
        .fold(nothing, |[low, high], a| [[0, 1].map(|k| low[k].min(a[k])), [0, 1].map(|k| high[k].max(a[k]))])
}

/// A map over positions and orientations.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceMap {
    /// Where.
    pub points: MapPoints,
    /// Answers, orientation by orientation and row by row; see [`WorkspaceMap::cell`].
    pub cells: Vec<Feasibility>,
}

impl WorkspaceMap {
    /// Asks at each point for the wrenches that `required` names for its pose.
    pub fn new(
        geometry: &Geometry,
        points: MapPoints,
        bounds: &Bounds,
        required: impl Fn(&[f64; 3]) -> RequiredWrenches,
    ) -> Self {
        let mut cells = Vec::with_capacity(points.phi.len() * points.y.len() * points.x.len());
        for phi in &points.phi {
            for y in &points.y {
                for x in &points.x {
                    let pose = [*x, *y, *phi];
                    cells.push(feasibility(geometry, &pose, bounds, &required(&pose)));
                }
            }
        }
        Self { points, cells }
    }

    /// The answer at `(x[i], y[j], phi[k])`.
    pub fn cell(&self, i: usize, j: usize, k: usize) -> &Feasibility {
        let MapPoints { x, y, .. } = &self.points;
        &self.cells[(k * y.len() + j) * x.len() + i]
    }

    /// For each position, row by row, the share of the orientations at which `holds`: where it is above 0 lies the maximal
    /// workspace, where it is 1 the inclusion workspace (Merlet, Parallel Robots, 2006, section 7.1).
    pub fn share_of_orientations(&self, holds: impl Fn(&Feasibility) -> bool) -> Vec<f64> {
        let positions = self.points.x.len() * self.points.y.len();
        let count = |at: usize| self.cells[at..].iter().step_by(positions).filter(|cell| holds(cell)).count();
        (0..positions).map(|at| count(at) as f64 / self.points.phi.len().max(1) as f64).collect()
    }
}
