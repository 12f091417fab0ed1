//! The workspace as table and as picture.

use std::fmt::Write as _;

use cdpr::statics::workspace::{Feasibility, MapPoints, WorkspaceMap};
use cdpr_drawing::{Area, Look, Robot};

/// A map and the area (m) that it covers.
pub(super) struct Map {
    pub(super) area: [[f64; 2]; 2],
    pub(super) found: WorkspaceMap,
}

/// The share of the orientations with the wrenches asked for, and with any wrench, for each position.
struct Shares {
    feasible: Vec<f64>,
    closed: Vec<f64>,
}

impl Map {
    fn shares(&self) -> Shares {
        let share = |holds: fn(&Feasibility) -> bool| self.found.share_of_orientations(holds);
        Shares { feasible: share(Feasibility::feasible), closed: share(Feasibility::closed) }
    }

    /// The orientations in words.
    pub(super) fn orientations(&self) -> String {
        match &self.found.points.phi[..] {
            [phi] => format!("φ = {phi} rad"),
            [from, .., to] => format!("{} angles from {from} to {to} rad", self.found.points.phi.len()),
            [] => String::new(),
        }
    }

    /// A row for each position and orientation.
    pub(super) fn csv(&self) -> String {
        let shares = self.shares();
        let MapPoints { x, y, phi } = &self.found.points;
        let mut csv = String::from("x,y,phi,reachable,closure,feasible,margin,balance,closure_share,feasible_share\n");
        for (k, phi) in phi.iter().enumerate() {
            for (j, y) in y.iter().enumerate() {
                for (i, x) in x.iter().enumerate() {
                    let cell = self.found.cell(i, j, k);
                    let flags = [cell.reachable, cell.closed(), cell.feasible()].map(u8::from);
                    let at = j * self.found.points.x.len() + i;
                    let (closed, feasible) = (shares.closed[at], shares.feasible[at]);
                    let _ = writeln!(
                        csv,
                        "{x},{y},{phi},{},{},{},{},{},{closed},{feasible}",
                        flags[0], flags[1], flags[2], cell.margin, cell.balance
                    );
                }
            }
        }
        csv
    }

    /// The robot on its workspace.
    pub(super) fn svg(&self, robot: &Robot) -> String {
        let shares = self.shares();
        let [every, some] = [1.0, f64::MIN_POSITIVE];
        let within = |share: &[f64], least: f64| share.iter().map(|s| *s >= least).collect::<Vec<bool>>();
        let at = self.orientations();
        let wanted = [
            (&shares.feasible, some, Look::Pale, format!("wrenches asked for: some of {at}")),
            (&shares.feasible, every, Look::Filled, format!("wrenches asked for: every one of {at}")),
            (&shares.closed, some, Look::Dashed, format!("any wrench, with enough tension: some of {at}")),
            (&shares.closed, every, Look::Outlined, format!("any wrench, with enough tension: every one of {at}")),
        ];
        let one = self.found.points.phi.len() == 1;
        let drawn: Vec<_> = wanted
            .into_iter()
            .filter(|(_, least, ..)| !one || *least == every)
            .map(|(share, least, look, name)| {
                (within(share, least), look, if one { name.replace("every one of ", "") } else { name })
            })
            .collect();
        let columns = self.found.points.x.len();
        let areas: Vec<Area> = drawn
            .iter()
            .map(|(cells, look, name)| Area { corners: self.area, columns, cells, look: *look, name })
            .collect();
        robot.svg_on(&areas)
    }

    /// The part of the area (1) with any wrench and with the wrenches asked for: at every orientation and at some.
    pub(super) fn parts(&self) -> [[f64; 2]; 2] {
        let shares = self.shares();
        let part = |share: &[f64], least: f64| {
            share.iter().filter(|s| **s >= least).count() as f64 / share.len().max(1) as f64
        };
        [&shares.closed, &shares.feasible].map(|share| [part(share, 1.0), part(share, f64::MIN_POSITIVE)])
    }
}
